"""Every number by which a diagnosis decides, with its unit, its reason, and the run that set it.

The text below a number begins with its unit in brackets and says what happens on either side of the number. Each text
ends with

- `Set by`: the run that determined the number;
- `Changed by`: the run or test that would reveal a wrong number, if no run that set it is recorded;
- `Derived`: the number follows from what the text says.

The runs:

- blind: `make blind`, the cases of the report block, seeds from 0 (single 260, pair 80, none 200, foreign 100, poor 65,
  snr 130); `blind none` is that kind alone;
- tune: the same commands with `--block tune`, whose cases may be inspected;
- second_plants: `python -m benchmarks.second_plants --kind KIND --seeds SEEDS`, cases of a second simulator;
- acceptance::x: the row x of the table in `tests/test_acceptance.py`, whose answer changes when the number is doubled
  or halved; selection::test_x: a test of `tests/test_selection.py` that then fails.

`docs/thresholds.csv` lists the rows for every number. Other modules read the numbers as attributes of this module, so
that a test can change a number in one place. Tolerances of searches and sizes of caches, which decide nothing, are in
the modules that use them.
"""

from __future__ import annotations

import math

# Noise -------------------------------------------------------------------------------------------------------

NOISE = 1.25
"""[times the noise floor] An error up to this is noise even if part of it depends on a known variable: the floor is
estimated from only part of the samples, and may miss slow noise. Changed by: blind none."""

FAR_ABOVE_NOISE = 2.0
"""[times the noise floor] An error above this is not noise, whether or not it depends on a known variable; coloured
noise stays below it. Records of only one loop support no name if more than this remains, since the right name with a
wrong shape leaves as large a residual as a wrong name does. Changed by: blind none, blind poor."""

STRUCTURE_SHARE = 0.15
"""[fraction of the error's variance] An error is structured if one variable explains more than this fraction of it on
unseen samples. Since it exceeds `VARIABLE_SHARE`, the variable is then also reported. Changed by: blind none."""


def is_noise(error: float, noise: float, share: float = 1.0) -> bool:
    """Whether an rms error is no more than noise.

    `noise`: the noise floor, in the unit of the error. `share`: the fraction of the error's variance that one variable
    explains. An error without structure is noise up to `FAR_ABOVE_NOISE` instead of `NOISE`, since coloured noise
    exceeds the floor.
    """
    structured = share > STRUCTURE_SHARE
    return not error > (NOISE if structured else FAR_ABOVE_NOISE) * noise


def apart(more: float, less: float) -> float:
    """rms by which an error exceeds a smaller one, if the excess is uncorrelated with the smaller one: sqrt(more^2 -
    less^2)."""
    return math.sqrt(max(more**2 - less**2, 0.0))


def above_noise(removed: float) -> float:
    """rms of noise plus an uncorrelated part `removed` times as large, as a multiple of the noise."""
    return math.sqrt(1.0 + removed**2)


# Whether an effect is named ----------------------------------------------------------------------------------

NAME_SHARE = 0.07
"""[fraction of the refitted gap, rms] An effect is named if it removes at least this from held-out or fitted records.
After the right effect in a wrong shape, a wrong effect removes up to 0.05. Set by: tune single (seeds not recorded)."""

NEARLY_ALL = 0.25
"""[fraction of the error before it] An effect is also named if at most this fraction remains: next to a far larger
effect, none can reach `NAME_SHARE`. Changed by: blind pair, selection::test_nearly_all_that_is_left_is_worth_a_name."""

FIRST_REMOVES = 0.6
"""[times the remaining error or the noise, whichever is larger] A first effect must remove at least this, and a smaller
difference between two effects does not count. Changed by: blind none (false names), blind snr (missed ones)."""

FURTHER_REMOVES = 1.0
"""[times the remaining error or the noise, whichever is larger] A further effect must remove at least this. After the
right effect with a wrong shape, wrong effects removed 0.7 to 0.98 in 4 of 60 single cases; real second effects removed
at least 1.2 in 120 cases. Set by: fresh single and pair cases of the report block (commit 633f8e9, seeds not
recorded)."""

NEEDLESS = 0.3
"""[times the noise] An earlier effect is dropped if the error without it is larger by less than this: half of
`FIRST_REMOVES`, so that chance does not drop an accepted effect. An alternative whose errors differ by less is not
followed where nothing follows the accepted effect: the same effects would fail. Changed by: blind pair,
selection::test_a_rival_that_leaves_the_same_errors_is_not_followed_up."""

P_SURE = 1e-3
"""[probability] The gain from an effect must have at most this p-value. Dozens of shapes are tried per round, so this
criterion alone would still pass a few per cent of the cases without an effect. Changed by: blind none."""

P_REPEATED = 0.05
"""[probability] On held-out records this p-value suffices if the fitted ones show the effect with `P_SURE`: the usual
level of a single test. Changed by: blind none."""

P_DIFFERENT = 0.01
"""[probability] Two effects are separable if the p-value of their difference is below this. Changed by: blind pair."""

BLOCK_MEMORIES = 2.0
"""[correlation times] Length of the blocks of samples that a test treats as independent: at this length neighbouring
blocks are hardly correlated. Changed by: blind none, acceptance::blocks_are_longer_than_errors_remember."""

BLOCKS = 20
"""[blocks] A record is cut into at least this many, even if its errors are correlated for longer than a block. Changed
by: acceptance::blocks_are_longer_than_errors_remember."""

SEEN_IN_BOTH = 0.25
"""[times the remaining error or the noise] An effect that removes `FIRST_REMOVES` or `FURTHER_REMOVES` from the fitted
or the held-out records must remove at least this from the others; an error that only one group shows may belong to
another effect. With 0.5, one of ten pairs loses its second name; with 0.25 or 0, none does, and 0 gives no false name
in 24 further cases. Set by: tune pair 0:10; with 0 also tune single, none and poor 0:8. Changed by: blind pair,
acceptance::an_effect_has_to_show_in_both."""

ALIKE = 0.25
"""[fraction of the held-out rms] Two effects whose errors differ by less than this are not separable, unless the
p-value of their difference is below `P_DIFFERENT`. Changed by: blind single (names right or among the alternatives)."""

BETTER = 0.05
"""[fraction of an error] An error that is lower by less than this does not justify more parameters, the exchange of an
accepted effect for another, or a longer search. Changed by: blind single,
selection::test_all_records_decide_between_equal_numbers."""

FAR_LESS = 0.5
"""[fraction of an error] A candidate whose fitted error is at most this fraction of another's wins despite a slightly
larger held-out error, most of which may belong to a third effect. Nor can chance reduce a held-out error this far,
since nothing was fitted to it: a rate dependence next to creep, visible only in a few steps, reduced the error to a
third with p = 0.12 over blocks. Set by (the latter): second_plants pair 2004. Changed by:
acceptance::equal_effects_come_in_the_order_of_the_catalogue, acceptance::what_chance_does_not_explain."""

EQUAL = 0.005
"""[fraction of an error] Errors that differ by less than this count as equal, however certain the difference, and
`selection.place` decides. The last steps of a search change an error by far less. Changed by:
acceptance::equal_effects_come_in_the_order_of_the_catalogue."""

MOST_OF_GAP = 0.5
"""[fraction of the gap above the noise] Records of one loop support a name only if at most this fraction remains with
the effect, and cannot separate several such effects: one curve up and one down hardly show which shape is right. Set
by: 180 fresh cases of kind poor, 7 of which had a false second name without this limit (commit 86e5f08, seeds not
recorded). Next to plays that depend on the rate, an element has merit only within the same limit: next to thermally
activated friction, false elements left 0.51 and 0.60; a true one, next to a rate dependence found before the lag that
it stands for, at most 0.41. Set by (the latter): blind pair 97023 and 97029. Changed by:
selection::test_next_to_plays_that_depend_on_the_rate_an_element_takes_most."""

LEAST_EXPLAINED = 0.5
"""[fraction of the variance above the noise] Names stand only if at most this fraction of the held-out and of the
fitted error remains with them, so that most is explained. Effects explain less of a disturbance: for room temperature
acting on the gain, and for a slow crosstalk line, false names left 0.74 to 0.79 of the fitted variance; right names
left at most 0.28. Set by: second_plants foreign 0:10, single 0:13. Changed by:
acceptance::names_near_the_noise_explain_half."""

MOSTLY_EXPLAINED = 1.0 / 3.0
"""[fraction of the variance above the noise] The same limit if the residual is above `MUCH_LEFT`, as with wrong names:
they must then explain two thirds. For room temperature acting on the gain, the wrong names ageing and self-heating left
0.39 to 0.41; right names left at most 0.30, where a second effect was missed. Set by: second_plants foreign 300:308,
single and pair 300:312. Changed by: second_plants foreign 400:410, acceptance::names_explain_most."""

MUCH_LEFT = 3.0
"""[times the noise floor] If the error with the named effects is above this, the verdict begins with that error; if, in
addition, a parameter is at an end of its range and more than `END_LEAVES` remains, none is named. In 457 blind cases
this happened for two disturbances due to room temperature and for one pair. Set by (the latter): second_plants foreign
11001, 11006, pair 8012, blind first 97000. Changed by: blind single, acceptance::what_a_verdict_says_first."""

END_LEAVES = 0.105
"""[fraction of the gap above the noise, rms] If more than `MUCH_LEFT` remains and a parameter of an effect is at an end
of its range, names stand only if at most this fraction of the held-out and of the fitted error remains with them: nine
tenths are then explained, rounded to a whole per cent as in the verdict. A multiple of the noise alone is no criterion
for records with little noise. False names for room temperature acting on the gain left 0.62 and more. Set by:
second_plants foreign 300:308, 11000:11020. Changed by:
selection::test_a_number_at_an_end_of_its_range_explains_nine_tenths."""

WIDER = 1.0
"""[times the width of a range] How far a range is widened beyond an end that a parameter has reached, in search
coordinates: ranges are chosen only to an order of magnitude. The wider range is kept if it lowers the held-out error by
`BETTER`. Changed by: selection::test_a_wider_range_where_a_number_is_at_its_end."""

WIDENINGS = 3
"""[searches] Maximum number of successive widenings of a range, each by `WIDER` usual widths. Changed by: run time, and
selection::test_how_often_a_range_is_widened."""

FEW_COMPARED = 0.25
"""[fraction of the samples] If fewer samples were compared, the verdict says so first and names nothing. In blind
records without a known history, at least 0.5 are compared; in a test whose amplitude keeps growing, only 0.02 to 0.06.
Set by: blind, all kinds, first 71000, and second_plants. Changed by: acceptance::what_a_verdict_says_first."""

FLAT_END = 0.005
"""[fraction of the drive range] A limit that begins closer to both ends than this is not named: the drive meets it only
in holds at the end and in a few other samples, so it acts like an offset in those holds, as residual creep does. Wrong
limits began at 0.0016 of the range, right ones at 0.0128 and more. Set by: second_plants single 9100 and 9165, blind
pair and poor first 97000. Changed by: acceptance::a_limit_at_the_very_end_of_the_drive."""

MOST_EFFECTS = 5
"""[effects] The search adds at most this many: no case of any block has more than two. Changed by: run time of
blind."""

MOST_RIVALS = 3
"""[effects] At most this many alternatives are tried in place of the latest effect. Changed by: blind pair."""

MOST_EXCHANGES = 4
"""[exchanges] Accepted effects are exchanged at most this often in a round, so two of them cannot replace each other
forever. Changed by: run time of blind."""

HELD_OUT_ALONE = 3.0
"""[times the fitted error] A held-out record with a larger error shows something that no fitted record shows. Changed
by: acceptance::held_out_records_that_are_alone."""

# How far a search goes ---------------------------------------------------------------------------------------

SCREENED = 6_000
"""[samples] Number compared in each group, fitted or held out, while all shapes are screened. Changed by: run time and
names of blind."""

SEARCHED = 12_000
"""[samples] Number used in later searches and in regressions on many variables. Changed by: run time and names of
blind."""

PLAYS = 32
"""[plays] Number of thresholds of a fit. With half as many, gaps between thresholds raise the error of records without
an effect to up to 1.4 times the noise; more do not help. Set by: tune none (commit 9f9a31e, seeds not recorded)."""

FIRST_STEPS = 2
"""[steps] Number taken from each start while shapes are screened. Changed by: blind single."""

SCREENING_STEPS = 2
"""[steps] Number then taken from the best start, and repeated while the error falls. Changed by: blind single."""

FALLING = 0.8
"""[fraction of the error] A search continues if `SCREENING_STEPS` bring its error below this fraction. The minimum of a
lightly damped resonance is too narrow to be reached in the first steps. Set by: tune single with resonance (commit
47d9267, seeds not recorded)."""

LONGER = 4
"""[times] `SCREENING_STEPS` are taken at most this often. Set by: tune single with resonance (commit 47d9267, seeds not
recorded)."""

TOO_FAR = 5.0
"""[times the error of the best start] No search begins at a start with a larger error. The best fit was reached from
starts with up to 3.5 (a limit of the output has no effect beyond the measured range). Set by: tune single (commit
0f80f02, seeds not recorded)."""

IDLE = 0.01
"""[fraction of the error] A start that changes the error by less has no effect yet, and is left out if another start
has one: next to a large effect, every start for a further effect may be worse than none. Changed by: blind pair."""

KEPT = 5
"""[shapes] Number followed up after the screening: those with the smallest held-out errors. Changed by: blind
single."""

ALSO_KEPT = 2
"""[shapes] Number of others followed up: those with the smallest fitted errors. Changed by: blind single."""

SHAPES_OF_ONE = 2
"""[shapes] Maximum number followed up per effect, which leaves room for other effects. Changed by: blind single."""

TWIN = 0.02
"""[fraction of the errors] An effect whose fitted and held-out errors are within this of a kept one's is followed up
too; otherwise chance would decide whether a lag or a delay is dropped. So is a shape with fewer parameters than the
kept shapes of its effect: a front that bends one way was once dropped because its error was 1 % larger than that of a
front that bends both ways. Set by (the latter): second_plants single 8001. Changed by: acceptance::a_twin_follows."""

PROMISING = 2.0
"""[times the error of the best shape] A shape with larger fitted and held-out errors is not searched jointly. Changed
by: blind pair."""

JOINT_STEPS = 5
"""[steps] Number taken in a joint search before the shapes are compared again. Changed by: blind single."""

HOPEFUL = 1.3
"""[times the held-out error of the best shape] A shape with a larger error after `JOINT_STEPS` is searched no further.
Changed by: blind single."""

RINGING_STARTS = 3
"""[frequencies] Number of ringing frequencies in the error from which the search for a resonance starts. Changed by:
blind single with resonance."""

BREAKS = 4
"""[breaks] Number of breaks in the dead-zone sum tried as an asymmetry. Changed by: blind single with asymmetry."""

FINER_BREAKS = 8
"""[breaks] If the dead-zone sum with `BREAKS` helps, this many are tried next: each interval is halved. Derived."""

TANH_BEND, TANH_SIDE = 0.3, 2.0
"""[1], [half ranges] Curvature and position of the tanh envelopes used as further starts, each bent one way over the
whole range. Changed by: blind single with asymmetry."""

LIMITERS = (0.03, 0.1)
"""[fractions of the range] Length of each end of the limiters used as starts. Changed by: blind single with
saturation."""

NOMINAL_RANGE = 3.0
"""[factor] Parameters of the nominal model's effects are refitted within this factor of their values, up or down:
outside, the effect would be a different one. Changed by: acceptance::numbers_move_by_up_to_a_factor."""

SINGLE_FACTORS = 4
"""[numbers] A longer list is refitted with one common factor: a factor for each number would make every list a fit of
its own. Changed by: acceptance::long_lists_have_one_factor."""

TOUCHING = 1e-6
"""[fraction of the slack] A nominal front may violate its constraints by this: files round to ten digits. Derived."""

START_SPAN = 2.0
"""[times the recorded drive range] The drive that led to the start state lies within a range at most this wide: from
farther away, the response to it could explain a drift. Changed by: acceptance::what_limits_the_start_of_an_effect."""

# What a front is called --------------------------------------------------------------------------------------

LIMITER_STRAIGHT = 0.6
"""[fraction of the range] A limiter keeps the slope of its middle over at least this. Changed by:
acceptance::what_a_front_is_called."""

LIMITER_NEAR = 0.1
"""[fraction of the range of slopes] A slope within this of the middle one counts as equal to it. Changed by:
acceptance::what_a_front_is_called."""

LIMITER_SLOPE = 0.6
"""[times the middle slope] A front whose slope at an end is smaller than this is certainly a limit. Changed by:
acceptance::what_a_front_is_called."""

ODD_FRONT = 2.0
"""[times] A front counts as saturation if its odd bend has more than this many times the power of its even bend.
Changed by: acceptance::what_a_front_is_called."""

# Which records are fitted, and which are held out ------------------------------------------------------------

COMPARED_SAMPLES = 20
"""[samples] A record can be fitted or held out only if more than this are compared: `BLOCKS` of one sample.
Quasi-static tests taken point by point have hardly more samples. Changed by: acceptance::enough_to_compare."""

SET_ASIDE = 0.3
"""[fraction of a record] If no whole record can be held out, this fraction at the end of each is held out: nearly the
third that is otherwise held out. Changed by: acceptance::the_end_of_a_record."""

FAST_RECORD = 0.5
"""[fraction of the largest] A record counts as fast (or wide) if its rate (or swing) is at least this fraction of the
largest. Changed by: acceptance::a_fast_record."""

THIN_STEPS = 32
"""[samples] Longest stretch that may be left out between two needed samples, a power of two. Changed by: run time,
acceptance::the_longest_stretch."""

THIN_STRAIGHT = 0.3
"""[times the noise] A stretch may be left out if the prediction over it deviates from a straight line by at most this,
and the drive by no more than it takes to move the output that far. Changed by: acceptance::a_bump_of_the_prediction."""

THIN_TURNING = 0.03
"""[times the noise] The same limit at a turning point, a tenth as large because the plays remember it. Changed by:
acceptance::a_small_turn_of_the_drive."""

THIN_RESIDUAL = 1.6
"""[times the noise, rms] The same limit for the remaining error: white noise deviates from the line between two of its
samples by sqrt(1 + 2/3) = 1.3, and an unlucky stretch by a quarter more. Derived."""

THIN_COLUMN = 0.01
"""[fraction of its range, rms] The same limit for a further column of the record. Changed by:
acceptance::a_column_that_jitters."""

EDGE = 0.03
"""[fraction of the drive range] A change of the drive is a jump if it is larger than this: a smaller one moves the
output by no more than some tens of times the noise, so its sample has little weight. Changed by: acceptance::a_jump."""

EDGE_SAMPLES, EDGE_STANDS = 2, 4
"""[samples], [samples] The longest jump that is not resolved, from one sample to the next or with an averaged sample
between, and the minimum number of samples for which the drive rests before and after it. With such samples, the
residual with a lag, a delay or a rate dependence was 2 to 8 times the noise; without them, 1.0 to 1.1. Set by:
second_plants single 0:13, pair 0:6."""

# Noise floor -------------------------------------------------------------------------------------------------

HOLD_SAMPLES = 40
"""[samples] A hold measures noise if it has at least this many: its trend has four coefficients, and 24 samples remain
after `HOLD_SETTLING`. Changed by: acceptance::jitter_of_the_drive."""

HOLD_DRIVE = 2e-4
"""[fraction of the drive range] The drive holds while it stays within this: three codes of a 14-bit converter. Changed
by: acceptance::jitter_of_the_drive."""

COARSE_DRIVE = 1e-3
"""[fraction of the drive range] The drive also holds while it changes by no more than one code of its converter, if a
code is no larger than this: ten bits. Coarser steps are levels of the drive. Changed by: acceptance::a_coarse_drive."""

HOLD_SETTLING = 0.4
"""[fraction of a hold] The beginning of a hold, left out because the output is still settling. Changed by:
acceptance::jitter_of_the_drive."""

HOLD_WEIGHT = 50
"""[times] A long hold counts as at most this many short ones. Changed by: blind none."""

QUIET_HOLDS = 0.25
"""[quantile of the variances] The quietest holds up to this quantile measure the noise: in the others something may
still ring or creep. Changed by: blind."""

RING_DECAY = 0.9
"""[fraction of the amplitude] A hold rings if its oscillation keeps more than this fraction from one sample to the
next. Changed by: acceptance::a_hold_that_rings."""

RING_UNPREDICTED = 0.3
"""[fraction of the variance] A hold rings only if a prediction from two samples misses at most this fraction of the
next one. Changed by: acceptance::a_hold_that_rings."""

PERIOD_REPEATS = 2e-3
"""[fraction of the drive range, rms] Periods of a drive measure noise if they differ by less than this: the response to
the difference adds as large a fraction of the output range to the noise. Changed by:
acceptance::periods_of_a_jittering_drive."""

HELD_SHARE = 0.55
"""[fraction of the changes] Samples of an output count as held or interpolated if at most this fraction of its changes
is nonzero: if every other sample was held, half of them are. Changed by: acceptance::samples_between."""

LEAST_NOISE = 1e-5
"""[fraction of the output range] Every record is assumed to have at least this noise: 17 bits, more than a stage's
sensor resolves in a single sample. Otherwise, simulated records would have a noise floor of 0, and any error would be
far above the noise. Changed by: acceptance::records_without_noise."""

# Faults of whole records and samples -------------------------------------------------------------------------

SCALE_OF_ALL = 3.0
"""[factor] If the outputs of all records differ from the prediction by this factor, they are in other units or from
another actuator. Changed by: blind foreign, acceptance::other_units_of_all."""

SCALE_OF_ONE = 1.7
"""[factor] The same limit for one record against the others: an actuator's sensitivity changes less with amplitude and
rate. Changed by: blind foreign, acceptance::a_narrow_record_shows_no_scale."""

WIDE_DRIVE = 0.3
"""[fraction of the widest drive] Only records whose drive is wider than this show their scale. Changed by:
acceptance::a_narrow_record_shows_no_scale."""

OTHER_UNIT = 30.0
"""[times the median width] A drive wider than this is in another unit, and is not used to judge the others. The value
lies between the ratio of a large swing to small loops and a factor of 1000 between units. Changed by:
acceptance::a_drive_in_another_unit_is_no_measure."""

DEAD_SENSOR = 0.1
"""[fraction of the expected spread] A sensor is dead if its output moves less than this and does not follow the drive.
Changed by: acceptance::a_dead_sensor."""

FOLLOWS = 0.9
"""[correlation] A scale is meaningful only if the output correlates with the prediction at least this well. Changed by:
acceptance::an_output_follows_its_drive."""

FOREIGN_CORRELATION, OWN_CORRELATION = 0.95, 0.5
"""[correlation] An output belongs to another record if it correlates with that record's prediction better than the
first number, and with its own prediction worse than the second. Changed by: blind foreign,
acceptance::the_output_of_another_record."""

LOOP_AREA = 0.3
"""[fraction of the expected area] An output follows its drive if its loop has at least this area, in the right sense.
Changed by: acceptance::an_output_follows_its_drive."""

LOOP_SIGMAS = 5.0
"""[standard deviations] The area of a loop counts if it exceeds the standard deviation due to white noise by this
factor: noise does so once in a million. Derived."""

OFF_LINE, ON_LINE = 6.0, 0.8
"""[scatters], [fraction of the samples] Samples farther off a line than the first number are ignored if the others make
up at least the second. Changed by: acceptance::a_few_samples_far_off_do_not_count."""

RAIL_PASSED = 0.01
"""[fraction of the output range] A value is still the limit of a converter if another record exceeds it by at most
this: records may differ by an offset. Changed by: acceptance::a_converter_ends_at_its_end."""

HISTORY_COSTS = 1.5
"""[times the error] If a history raises the error of samples that do not depend on it by more than this, it has bent
the model. Changed by: blind single (wrong histories),
acceptance::a_history_that_costs_the_rest."""

# Lines and ripples -------------------------------------------------------------------------------------------

LINE_SHARE = 0.03
"""[fraction of the error's variance] A line must have at least this fraction: smaller ones are not worth reporting.
Changed by: acceptance::share_of_a_line."""

RULING_SHARE = 0.3
"""[fraction of the error's variance] A line with at least this fraction is removed before the search for effects, and
counts even if few records have it; a weaker line may be due to a missing effect. Changed by: blind foreign,
acceptance::a_line_rules."""

LINE_HEIGHT = 30.0
"""[times the median power around it] A line must be at least this high: the highest of 10000 bins of noise reaches 13.
Changed by: blind none."""

PEAK_HEIGHT = 10.0
"""[times the median power around it] A line of the drive must be at least this high, and so must ringing in averaged
spectra, whose noise scatters less. Changed by: acceptance::height_of_a_line_of_the_drive."""

DRIVE_LINE_SHARE = 1e-6
"""[fraction of the drive's power] A peak of the drive is a line of its own if it has at least this fraction: a
thousandth of the amplitude. Changed by: acceptance::a_line_of_the_drive."""

CARRIER_SHARE = 0.5
"""[fraction of the drive's power] A drive with at least this fraction in one line causes harmonics of it, even if its
amplitude varies. Changed by: acceptance::harmonics_of_a_carrier."""

HARMONICS = 10
"""[harmonics] Number of multiples of such a line expected in the actuator's response. Changed by:
acceptance::harmonics_of_a_carrier."""

LINE_PERIODS = 8
"""[periods] A record can show a line, and its travel a ripple, if it has at least this many periods or pitches: trends
fill the bins below. Changed by: acceptance::periods_of_a_line."""

LINE_SAMPLES = 64
"""[samples] A record can show a line or a period only if it has this many: eight for each of `LINE_PERIODS`.
Derived."""

SPECTRUM_SAMPLES = 256
"""[samples] A spectrum, and a search for a ripple, needs at least this many: three times the surroundings of a peak.
Changed by: acceptance::samples_of_a_spectrum."""

SPECTRUM_PARTS = (8, 64)
"""[parts of a record] Numbers of parts whose mean spectra are searched for fading ringing: with these, it is found at
0.4 to 3 % damping after steps every five seconds. Set by: disturbances (commit 8380866)."""

SURROUNDINGS, SURROUNDINGS_OF_PARTS = 40, 12
"""[bins] A peak is compared with this many on either side, in the spectrum of a record and in the mean spectrum of its
parts. Changed by: acceptance::surroundings_of_a_line."""

SAME_BINS = 1.5
"""[bins] Lines closer than this are one line: less than two bins, half the main lobe of a Hann window. Derived."""

SAME_RINGING = 0.02
"""[fraction of the frequency] Closer ringing frequencies give a single start for a resonance. Changed by: blind
single."""

SAME_LINE = 0.05
"""[fraction of the frequency or pitch] A line within this of a stronger one is a remainder of it. Changed by:
acceptance::the_rest_of_a_line."""

MOST_LINES = 4
"""[lines] At most this many are searched for: mains, two harmonics and a ripple. Changed by: blind foreign."""

CRESTS = 5
"""[bins] Number of the highest bins of a spectrum that are examined: `MOST_LINES` and one for the drive. Derived."""

SEEN_IN = 0.4
"""[fraction of the records that are long enough] A line counts if at least this fraction of the records has it, or if
it has `RULING_SHARE`. Changed by: acceptance::a_line_in_many_records."""

COMMON_SHARE = 0.6
"""[fraction of the records, or of the passes] A line is steady, and a ripple confirmed, if the test holds in at least
this fraction, that is, in most. Changed by: acceptance::pitches_of_a_pass."""

STEADY_SHARE = 0.5
"""[fraction] A line is steady if the phase and amplitude fitted to one half of a record remove at least this fraction
of the amount that the other half's own fit removes. Changed by: acceptance::a_line_that_fades."""

AMPLITUDE_SAMPLES = 2.2
"""[samples per period] With fewer, a line's amplitude cannot be measured: Nyquist's two and a tenth more. Derived."""

MAINS_TOLERANCE = 0.002
"""[fraction of the frequency] A line within this of the mains or its harmonics is hum: 0.1 Hz at 50 Hz, twice the band
within which the grid is held. Derived."""

RIPPLE_RESOLVED = 0.25
"""[pitches per sample] A sample resolves a ripple if the position moves by less than this until the next sample: four
samples per period. Derived."""

CONVERTER_STEP = 0.02
"""[fraction of the pitch] A pitch that differs by less than this from the smallest step of the output, or from a whole
fraction of it, is the converter's and no ripple. Changed by: acceptance::a_pitch_of_the_converter."""

POSITION_BINS = 4096
"""[bins] To find a pitch, the range is divided into this many, and errors are averaged in each: enough for pitches of a
thousandth of the range. Changed by: acceptance::the_finest_pitch."""

PITCHES = 3
"""[pitches] Number of the strongest pitches that are examined. Changed by: acceptance::pitches_that_are_examined."""

PASS_SAMPLES, PASS_PITCHES = 32, 3.0
"""[samples], [pitches] A pass, up or down, must have at least these to confirm a ripple. Changed by:
acceptance::pitches_of_a_pass."""

DRIVE_REPEATS = 0.01
"""[fraction of the drive range, rms] A drive repeats itself if it differs by less than this from itself a period later:
more than the noise of a measured drive. Changed by: acceptance::a_noisy_drive_repeats."""

DRIVE_AWAY = 0.25
"""[fraction of the drive range, rms] A drive has a period only if it differs from itself by more than this at some
shorter shift; otherwise, one that mostly rests would seem to repeat at any shift. Changed by:
acceptance::a_drive_that_mostly_rests."""

# Stick-slip --------------------------------------------------------------------------------------------------

SLIP_RESOLVED = 7.0
"""[times the noise] Stretches over which the prediction moves by this are examined: noise alone then makes the output
stand still in one stretch in a hundred. Derived."""

SLIP_STRETCH = 0.5, 3.0
"""[times `SLIP_RESOLVED`] Smallest and largest motion of a stretch that counts. Changed by:
acceptance::how_much_stands."""

SLIP_OFF = 0.6
"""[fraction of the predicted motion] The output stands still if its motion falls short of the prediction by at least
this, and leaps if its motion exceeds the prediction by at least this. Changed by: acceptance::how_much_stands."""

SLIP_STANDS, SLIP_LEAPS = 0.15, 0.05
"""[fraction of the stretches] With stick-slip, the output stands still in at least the first fraction and leaps in at
least the second. Changed by: blind foreign, acceptance::how_much_stands."""

SLIP_CONTINUES = 0.3
"""[correlation] Neighbouring stretches of stick-slip correlate at most this much: a lag continues from one to the next,
whereas a leap makes up for the standstill before it. Changed by: acceptance::what_goes_on."""

SLIP_MOVING = 0.25
"""[fraction of the upper quartile of moves] A prediction that moves less than this is at rest. Changed by:
acceptance::samples_that_hardly_move_do_not_count."""

SLIP_JUMPS = 5
"""[jumps] Stick-slip has at least this many; at least ten times as many samples and five times as many stretches must
move. Changed by: acceptance::how_many_jumps."""

SLIP_ALONE = 3.0
"""[times the moves around it] A jump is larger by this factor than the moves two to five samples away; in a smooth
output, however fast, these are about as large. Most jumps of stick-slip are of this kind. Changed by:
acceptance::a_fast_output_does_not_jump."""

# What drives are like ----------------------------------------------------------------------------------------

REVERSAL = 0.02
"""[fraction of the drive range] A reversal is at least this large, above the noise of a measured drive. Changed by:
acceptance::a_small_turn."""

LOOP_ENDS = 0.1
"""[fraction of the drive range] Loops whose ends lie within this of each other are one loop. Changed by: blind poor."""

LOOP_SPEEDS = 1.5
"""[ratio of times] Loops are at one speed if their times differ by at most this factor. Changed by: blind poor."""

LOOP_STANDS = 0.3
"""[fraction of the time between turns] A drive that rests for longer is holding, not following a loop. Changed by:
acceptance::a_loop_that_stands_is_none."""

# How the remaining error is described ------------------------------------------------------------------------

MAIN_SHARE = 0.5
"""[fraction of the error's variance] The verdict is about a disturbance if it has at least this fraction: it then makes
up most of the error. Derived."""

STRETCH_ABOVE_NOISE = 1.5
"""[times the noise floor] A stretch with a larger error is listed. A stretch has a 24th of the samples of a record, and
over so few the rms of coloured noise scatters more. Changed by: blind none."""

FAST_QUANTILE = 0.9
"""[quantile of the rates] A stretch is fast if its mean rate is above this quantile. Changed by:
acceptance::above_the_noise."""

RANGE_END, RANGE_END_SHARE = 0.1, 0.6
"""[fraction of the drive range], [fraction of a stretch] A stretch is at the ends of the range if at least the second
fraction of it lies within the first fraction of either end. Changed by: acceptance::ends_of_the_range."""

VARIABLE_SHARE = 0.1
"""[fraction of the error's variance] A variable that explains less is not reported. Changed by:
acceptance::a_variable_that_matters."""

VARIABLE_BINS = 24
"""[bins] Number used to describe a function of one variable. Changed by: acceptance::folds."""

FOLD_BLOCKS = 16
"""[blocks] Samples alternate between fit and test in this many blocks, which are longer than errors are correlated.
Changed by: acceptance::folds."""

DESCRIBED_SAMPLES = 200
"""[samples] An error is described if it has at least this many: about eight in each of `VARIABLE_BINS`. Derived."""

MEMORY_WINS = 1.25
"""[times] Memory is reported in place of a single variable if it explains at least this many times as much. Changed by:
acceptance::memory_in_place_of_one_variable."""

RATE_FREE_SHARE = 0.75
"""[fraction] An error does not depend on rates if drive and memory alone explain at least this fraction of what they
explain together with rates. Changed by: acceptance::rate_free."""

REPEATABLE_SHARE = 0.5
"""[fraction of the error's variance] An error is repeatable if this fraction recurs with the drive: that is, most of
it. Derived."""

PARITY_BINS, PARITY_SAMPLES = 20, 10
"""[bins], [samples] The even fraction is taken over this many bins of the drive's range, each of which has more than
this many samples. Changed by: acceptance::parity."""

PARITY_SHARE = 0.05
"""[fraction of the error's variance] Parity is meaningful only if the mean over drive and direction has at least this
fraction: half of `VARIABLE_SHARE`. Derived."""

# Whether an inverse does more than records support -------------------------------------------------------------

WILDER = 2.0
"""[times] An inverse is calm if its drive's second differences are at most this many times those of the plain inverse's
drive: hysteresis alone turns a drive that often. Changed by: acceptance::a_drive_that_is_rougher."""

BEYOND_GAIN = 3.0
"""[times the gain] Largest change that an inverse with effects may make to the plain model's output, as a multiple of
the held-out rms that the effects explain or, if larger, of the noise. The multiple was 0.85 to 0.97 for creep, a lag
and relaxing plays at three speeds, with noise at 0.1 % of the output. Changed by:
acceptance::an_output_that_moves_further."""

SHARED_DEGREE = 5
"""[degree] Polynomial in time, for each record, that any drift may follow: a column that shares it explains the drift
without being its cause. Set by: benchmarks/influences.py."""

SHARED_LAGS = (0.003, 0.02, 0.1)
"""[fractions of a record] Time constants of averages of the drive that a column may share with the output, as a monitor
of the drive or of its current does. Set by: benchmarks/influences.py."""

OWN_SHARE = 0.08
"""[fraction of the removed power] A column is named only if at least this much of what it removes belongs to it alone,
apart from time, mains and drive: 0.14 and more for the other axis of `examples/xy_stage`, at most 0.03 for a column
that shares its drift with the output. Set by: benchmarks/influences.py."""
