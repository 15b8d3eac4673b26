"""Every number of a diagnosis that decides something: its unit, its reason, and the run that set it or would change it.

The unit comes first, in brackets. `Set by` names the run that a number comes from; if none is recorded, the reason says
what the number is derived from or compared with, and `Changed by` names the run that would show it wrong. Runs:

- blind: `make blind`, the cases of the report block, seeds from 0 (single 260, pair 80, none 200, foreign 100, poor 65,
  snr 130); `blind none` is that kind alone;
- tune: the same commands with `--block tune`, whose cases may be looked at;
- `disturbances::test_x`: the test of `tests/test_disturbances.py` that fails when the number is doubled, or halved.

`docs/thresholds.csv` has such tests for every number, each with its case, written by `python -m tests.threshold_mutants
--write`. Other modules read the numbers as attributes of this one, so that a number can be changed in one place.
Tolerances of searches and sizes of caches, which decide nothing, are in the modules that use them.
"""

from __future__ import annotations

import math

# Noise -------------------------------------------------------------------------------------------------------

NOISE = 1.25
"""[times the noise floor] An error up to this is noise, whatever it depends on: the floor is an estimate from a part of
the samples, which may miss slow noise. Changed by: blind none."""

FAR_ABOVE_NOISE = 2.0
"""[times the noise floor] An error above this is not noise, whatever it depends on; with records of only one loop it
supports no name, since a right name in a wrong shape leaves as much as a wrong name. Coloured noise stays below it.
Changed by: blind none, blind poor."""

STRUCTURE_SHARE = 0.15
"""[share of the error's variance] An error of which one variable explains more than this on unseen samples is
structured: more than `VARIABLE_SHARE`, so that what counts is reported too. Changed by: blind none."""


def is_noise(error: float, noise: float, share: float = 1.0) -> bool:
    """Whether an rms error is no more than noise.

    `share`: of its variance that depends on something known; without structure only `FAR_ABOVE_NOISE` speaks against
    noise, since coloured noise exceeds its floor.
    """
    limit = NOISE if share > STRUCTURE_SHARE else FAR_ABOVE_NOISE
    return not error > limit * noise


def apart(more: float, less: float) -> float:
    """rms of the part of one error that a smaller one does not have."""
    return math.sqrt(max(more**2 - less**2, 0.0))


def above_noise(removed: float) -> float:
    """An error as a multiple of the noise, if it consists of noise and something else of `removed` times its rms."""
    return math.sqrt(1.0 + removed**2)


# Whether an effect gets a name -------------------------------------------------------------------------------

NAME_SHARE = 0.07
"""[share of the refitted gap, rms] An effect removes at least this of held-out or of fitted records: what a right name
in a wrong shape leaves to a second name is up to 0.05. Set by: tune single (seeds not recorded)."""

NEARLY_ALL = 0.25
"""[share of the error before it] Or it leaves at most this: beside a far larger effect, `NAME_SHARE` is out of reach.
Changed by: blind pair, selection::test_nearly_all_that_is_left_is_worth_a_name."""

FIRST_REMOVES = 0.6
"""[times the remaining error or the noise, whichever is larger] The least that a first effect removes, and the least
difference that counts between two effects. Changed by: blind none (false names), blind snr (missed ones)."""

FURTHER_REMOVES = 1.0
"""[the same] The least that a further effect removes: leftovers of a right name in a wrong shape were 0.7 to 0.98 in 4
of 60 single cases, real second effects at least 1.2 in 120 cases. Set by: fresh single and pair cases of the report
block (commit 633f8e9, seeds not recorded)."""

NEEDLESS = 0.3
"""[times the noise] An earlier effect whose loss adds less than this is dropped: half of `FIRST_REMOVES`, so that an
accepted effect is not dropped by chance. Changed by: blind pair."""

P_SURE = 1e-3
"""[probability] Largest p-value of the difference that an effect makes; tens of shapes are tried in a round, so a few
per cent of effect-free cases would pass this test alone. Changed by: blind none."""

P_REPEATED = 0.05
"""[probability] The same on held-out records where fitted ones show it with `P_SURE`: the usual level of one test.
Changed by: blind none."""

P_DIFFERENT = 0.01
"""[probability] Two effects whose difference is less likely by chance are separable. Changed by: blind pair."""

BLOCK_MEMORIES = 2.0
"""[correlation times] Length of the blocks that a test takes as independent: neighbours are then hardly correlated.
Changed by: blind none, acceptance::test_blocks_are_longer_than_errors_remember."""

BLOCKS = 20
"""[blocks] Least number of blocks of a record where its errors remember longer than that allows. Changed by:
acceptance::test_blocks_are_longer_than_errors_remember."""

SEEN_IN_BOTH = 0.25
"""[times the remaining error or the noise] Least that an effect removes from both fitted and held-out records, while it
removes `FIRST_REMOVES` or `FURTHER_REMOVES` from one of them; an error that only one of them shows may belong to
another effect. With 0.5 one of ten pairs loses its second name; with 0.25 none does, nor with 0, without a false name
in 24 further cases.
Set by: tune pair 0:10; with 0 also tune single, none and poor 0:8. Changed by: blind pair,
acceptance::test_an_effect_has_to_show_in_both."""

ALIKE = 0.25
"""[share of the held-out rms] Effects within this are not separable, unless chance explains it with less than
`P_DIFFERENT`. Changed by: blind single (names right or among the alternatives)."""

BETTER = 0.05
"""[share of an error] An error lower by less than this is no reason for more numbers, for another effect in the place
of an accepted one, or for following a shape further. Changed by: blind single,
selection::test_all_records_decide_between_equal_numbers."""

FAR_LESS = 0.5
"""[share of an error] A fitted error of at most this share of another outweighs a small lead of the other on held-out
records, which yet another effect may dominate. Changed by:
acceptance::test_equal_effects_come_in_the_order_of_the_catalogue."""

EQUAL = 0.005
"""[share of an error] Errors closer than this are equal, and the order of the catalogue decides: far above what the
last steps of a search change. Changed by: acceptance::test_equal_effects_come_in_the_order_of_the_catalogue."""

MOST_OF_GAP = 0.5
"""[share of the gap above the noise] Records of one loop support a name only if at most this is left, and leave open
all names that leave at most this: two curves, up and down, hardly show which shape is the right one. Set by: 180
fresh cases of kind poor, 7 of which had a false second name without it (commit 86e5f08, seeds not recorded)."""

LEAST_EXPLAINED = 0.5
"""[share of the variance above the noise] Names stand only if together they leave at most this of held-out and of
fitted records, so that most is explained. A disturbance has less in common: room temperature on the gain and
a slow crosstalk line kept 0.74 to 0.79 of the fitted variance under false names, right names at most 0.28. Set by:
second_plants foreign 0:10, single 0:13. Changed by: acceptance::test_names_near_the_noise_explain_half."""

MOSTLY_EXPLAINED = 1.0 / 3.0
"""[share of the variance above the noise] The same for names that leave more than `MUCH_LEFT`, as wrong names do: they
have to explain two thirds. Room temperature on the gain kept 0.39 to 0.41 under the names of ageing and self-heating,
right names at most 0.30, beside a second effect that was not found. Set by: second_plants foreign 300:308, single and
pair 300:312. Changed by: second_plants foreign 400:410, acceptance::test_names_explain_most."""

MUCH_LEFT = 3.0
"""[times the noise floor] A verdict that names effects begins with what they leave if it is more. Changed by: blind
single, acceptance::test_what_a_verdict_says_first."""

FEW_COMPARED = 0.25
"""[share of the samples] If fewer took part, a verdict says so first and names nothing: at least 0.5 of blind records
without a known history do, and 0.02 to 0.06 of a test whose amplitude grows to the end. Set by: blind, all kinds, first
71000, and second_plants. Changed by: acceptance::test_what_a_verdict_says_first."""

MOST_EFFECTS = 5
"""[effects] Most effects that are added: no case of any block has more than two. Changed by: run time of blind."""

MOST_RIVALS = 3
"""[effects] Alternatives that are tried in place of the latest effect. Changed by: blind pair."""

MOST_EXCHANGES = 4
"""[exchanges] Most exchanges of an accepted effect in a round, so that two cannot replace each other forever. Changed
by: run time of blind."""

HELD_OUT_ALONE = 3.0
"""[times the fitted error] A held-out record with more than this shows something that no fitted one does. Changed by:
acceptance::test_held_out_records_that_are_alone."""

# How far a search goes ---------------------------------------------------------------------------------------

SCREENED = 6_000
"""[samples] Compared while all shapes are screened, fitted and held out each. Changed by: run time and names of
blind."""

SEARCHED = 12_000
"""[samples] Fitted in later searches, and used where many variables are regressed together. Changed by: as before."""

PLAYS = 32
"""[plays] Thresholds of a fit: half as many leave up to 1.4 times the noise in effect-free records because of the gaps
between them; more leave no less. Set by: tune none (commit 9f9a31e, seeds not recorded)."""

FIRST_STEPS = 2
"""[steps] Of a search from each start while shapes are screened. Changed by: blind single."""

SCREENING_STEPS = 2
"""[steps] Of a search from the best start, repeated while it still falls. Changed by: blind single."""

FALLING = 0.8
"""[share of the error] A search whose error falls below this within `SCREENING_STEPS` continues: with light damping the
minimum is too narrow for the first steps. Set by: tune single with resonance (commit 47d9267, seeds not recorded)."""

LONGER = 4
"""[times] `SCREENING_STEPS` are repeated at most this often. Set by: as before."""

TOO_FAR = 5.0
"""[times the error of the best start] No search begins at a start with more: the best end was reached from up to 3.5 (a
limit of the output has no effect beyond the measured range). Set by: tune single (commit 0f80f02, seeds not
recorded)."""

IDLE = 0.01
"""[share of the error] A start that changes the error by less does nothing yet, and others go first: behind a large
effect every start of the next may be worse than none. Changed by: blind pair."""

KEPT = 5
"""[shapes] Followed up after the screening, the best on held-out records. Changed by: blind single."""

ALSO_KEPT = 2
"""[shapes] And others that fit best. Changed by: blind single."""

SHAPES_OF_ONE = 2
"""[shapes] Most of one effect among those: the others go to other effects. Changed by: blind single."""

TWIN = 0.02
"""[share of the errors] An effect that leaves as much as one of those, fitted and held out, is followed too; otherwise
chance would decide whether a lag or a delay is cut off. Changed by: acceptance::TestScreening::test_a_twin_follows."""

PROMISING = 2.0
"""[times the error of the best shape] A shape that leaves more, fitted and held out, is not searched jointly. Changed
by: blind pair."""

JOINT_STEPS = 5
"""[steps] Of a joint search before the shapes are compared again. Changed by: blind single."""

HOPEFUL = 1.3
"""[times the held-out error of the best shape] A shape that leaves more after those steps is not polished. Changed by:
blind single."""

RINGING_STARTS = 3
"""[frequencies] Frequencies of ringing in the error that are starts for a resonance. Changed by: blind single with
resonance."""

BREAKS = 4
"""[breaks] Of the dead-zone sum with which an asymmetry is sought. Changed by: blind single with asymmetry."""

FINER_BREAKS = 8
"""[breaks] Of the sum that is tried where that helps: each interval halved. Derived."""

TANH_BEND, TANH_SIDE = 0.3, 2.0
"""[1], [half ranges] Curvature and place of tanh envelopes as further starts: bent one way over the whole range.
Changed by: blind single with asymmetry."""

LIMITERS = (0.03, 0.1)
"""[shares of the range] Depths at either end of limiters as starts. Changed by: blind single with saturation."""

NOMINAL_RANGE = 3.0
"""[factor] Numbers of the nominal model's effects are refitted up to this times as large and as small: farther off, the
effect is a different one. Changed by: acceptance::TestNominal::test_numbers_move_by_up_to_a_factor."""

SINGLE_FACTORS = 4
"""[numbers] A longer list of numbers has one common factor: each of more would be a fit of its own. Changed by:
acceptance::TestNominal::test_long_lists_have_one_factor."""

TOUCHING = 1e-6
"""[of the slack] By this a nominal front may violate its constraints: ten digits of a file are rounded. Derived."""

START_SPAN = 2.0
"""[times the recorded drive range] The start state comes from a drive at most this wide: farther off its response would
explain a drift. Changed by: acceptance::test_what_limits_the_start_of_an_effect."""

# What a front is called --------------------------------------------------------------------------------------

LIMITER_STRAIGHT = 0.6
"""[share of the range] A limiter has the middle slope over at least this. Changed by:
acceptance::test_what_a_front_is_called."""

LIMITER_NEAR = 0.1
"""[share of the range of slopes] A slope within this of the middle one is equal to it. Changed by:
acceptance::test_what_a_front_is_called."""

LIMITER_SLOPE = 0.6
"""[times the middle slope] Only a limit has a smaller slope at an end. Changed by:
acceptance::test_what_a_front_is_called."""

ODD_FRONT = 2.0
"""[times] A front whose odd bend has more than this times the power of the even one saturates. Changed by:
acceptance::test_what_a_front_is_called."""

# Which records are fitted and held out -----------------------------------------------------------------------

COMPARED_SAMPLES = 20
"""[samples] More than this are compared of a record that fits or judges: `BLOCKS` of one sample. Quasi-static tests
taken point by point have no more. Changed by:
acceptance::TestHeldOut::test_enough_to_compare."""

SET_ASIDE = 0.3
"""[share of a record] Its end, held out where no record can be: nearly the third that is taken of several records.
Changed by: acceptance::TestHeldOut::test_the_end_of_a_record."""

FAST_RECORD = 0.5
"""[share of the largest] A record is fast, or wide, from this rate, or swing, on. Changed by:
acceptance::TestHeldOut::test_a_fast_record."""

THIN_STEPS = 32
"""[samples] Longest stretch without a needed sample, a power of two. Changed by: run time,
acceptance::TestThinning::test_the_longest_stretch."""

THIN_STRAIGHT = 0.3
"""[times the noise] The prediction over a stretch is off a straight line by at most this, and the drive by what makes
that much output. Changed by: acceptance::TestThinning::test_a_bump_of_the_prediction."""

THIN_TURNING = 0.03
"""[times the noise] The same at a turning point, which the plays remember: a tenth. Changed by:
acceptance::TestThinning::test_a_small_turn_of_the_drive."""

THIN_RESIDUAL = 1.6
"""[times the noise, rms] The same for the remaining error: white noise is off lines through itself by sqrt(1 + 2/3) =
1.3, and noise of an unlucky stretch by a quarter more. Derived."""

THIN_COLUMN = 0.01
"""[share of its range, rms] The same for a further column. Changed by:
acceptance::TestThinning::test_a_column_that_jitters."""

EDGE = 0.03
"""[share of the drive range] A jump of the drive is larger than this: a smaller one moves the output by no more than
some tens of times the noise, and its sample counts little. Changed by: acceptance::TestEdges::test_a_jump."""

EDGE_SAMPLES, EDGE_STANDS = 2, 4
"""[samples], [samples] Longest jump that is not resolved, from one sample to the next or with an averaged one between,
and fewest samples for which the drive stands before and after it. With these samples compared, a lag, a delay or a rate
dependence left 2 to 8 times the noise, without them 1.0 to 1.1. Set by: second_plants single 0:13, pair 0:6."""

# Noise floor -------------------------------------------------------------------------------------------------

HOLD_SAMPLES = 40
"""[samples] Fewest of a hold that measures noise: its trend has four numbers, and 24 samples after `HOLD_SETTLING`.
Changed by: acceptance::TestNoiseFloor::test_jitter_of_the_drive."""

HOLD_DRIVE = 2e-4
"""[share of the drive range] The drive holds while it stays within this: three codes of a 14-bit converter. Changed by:
acceptance::TestNoiseFloor::test_jitter_of_the_drive."""

COARSE_DRIVE = 1e-3
"""[share of the drive range] A drive also holds while it changes by one code of its converter, if that is no larger:
ten bits. Coarser values are levels. Changed by: acceptance::TestNoiseFloor::test_a_coarse_drive."""

HOLD_SETTLING = 0.4
"""[share of a hold] Its beginning, which is left out, since it still settles there. Changed by:
acceptance::TestNoiseFloor::test_jitter_of_the_drive."""

HOLD_WEIGHT = 50
"""[times] A long hold counts at most this often. Changed by: blind none."""

QUIET_HOLDS = 0.25
"""[quantile of the variances] The holds that count: in others something may still ring or creep. Changed by: blind."""

RING_DECAY = 0.9
"""[1/sample] A hold rings if its oscillation decays by less. Changed by:
acceptance::TestNoiseFloor::test_a_hold_that_rings."""

RING_UNPREDICTED = 0.3
"""[share of the variance] And two samples leave at most this of the next unpredicted. Changed by:
acceptance::TestNoiseFloor::test_a_hold_that_rings."""

PERIOD_REPEATS = 2e-3
"""[share of the drive range, rms] Periods whose drives differ by less measure noise: the response to the difference
adds as large a share of the output to it. Changed by: acceptance::TestNoiseFloor::test_periods_of_a_jittering_drive."""

HELD_SHARE = 0.55
"""[share of the changes] An output of whose changes at most this share is not 0 has samples that were held or
interpolated: half of the changes if every other sample was. Changed by:
acceptance::TestNoiseFloor::test_samples_between."""

LEAST_NOISE = 1e-5
"""[share of the output range] Noise that every record is assumed to have: 17 bits, more than sensors of a stage resolve
in a single sample. Without it, records of a simulation would have a floor of 0, and any error would be far above it.
Changed by: acceptance::TestNoiseFloor::test_records_without_noise."""

# Faults of whole records and samples -------------------------------------------------------------------------

SCALE_OF_ALL = 3.0
"""[factor] An output of all records this far off the prediction is in other units, or of another actuator. Changed by:
blind foreign, acceptance::TestWholeRecords::test_other_units_of_all."""

SCALE_OF_ONE = 1.7
"""[factor] The same of one record against the others: an actuator's sensitivity changes less with amplitude and rate.
Changed by: blind foreign, acceptance::TestWholeRecords::test_a_narrow_record_shows_no_scale."""

WIDE_DRIVE = 0.3
"""[share of the widest drive] Only records with a wider drive show their scale. Changed by:
acceptance::TestWholeRecords::test_a_narrow_record_shows_no_scale."""

OTHER_UNIT = 30.0
"""[times the median width] A wider drive is in another unit, and no measure for the others: between the swing of small
loops and a factor of 1000. Changed by: acceptance::TestWholeRecords::test_a_drive_in_another_unit_is_no_measure."""

DEAD_SENSOR = 0.1
"""[share of the expected spread] An output that moves less and does not follow the drive is dead. Changed by:
acceptance::TestWholeRecords::test_a_dead_sensor."""

FOLLOWS = 0.9
"""[correlation] Least correlation with the prediction at which a scale means something. Changed by:
acceptance::TestWholeRecords::test_an_output_follows_its_drive."""

FOREIGN_CORRELATION, OWN_CORRELATION = 0.95, 0.5
"""[correlation] An output belongs to another record whose prediction it follows better than the first number, if it
follows its own worse than the second. Changed by: blind foreign,
acceptance::TestWholeRecords::test_the_output_of_another_record."""

LOOP_AREA = 0.3
"""[share of the expected area] An output follows its drive if its loop has at least this, in the right sense. Changed
by: acceptance::TestWholeRecords::test_an_output_follows_its_drive."""

LOOP_SIGMAS = 5.0
"""[standard deviations] An area counts if it exceeds this times what white noise makes. Derived: one in a million."""

OFF_LINE, ON_LINE = 6.0, 0.8
"""[scatters], [share of the samples] Samples farther off a line do not count, unless they are more than the second
number leaves. Changed by: acceptance::TestWholeRecords::test_a_few_samples_far_off_do_not_count."""

RAIL_PASSED = 0.01
"""[share of the output range] Another record may pass a converter's end by this: two records differ by an offset.
Changed by: acceptance::TestWholeRecords::test_a_converter_ends_at_its_end."""

HISTORY_COSTS = 1.5
"""[times the error] A history that raises the error of what does not depend on it by more has bent the model. Changed
by: blind single (wrong histories), acceptance::TestWholeRecords::test_a_history_that_costs_the_rest."""

# Lines and ripples -------------------------------------------------------------------------------------------

LINE_SHARE = 0.03
"""[share of the error's variance] Of a line at least: smaller ones are not worth a sentence. Changed by:
acceptance::TestSpectra::test_share_of_a_line."""

RULING_SHARE = 0.3
"""[share of the error's variance] Of a line that is taken out before the search for effects, or that is only in a few
records: the error of a missing effect may look like a weaker line. Changed by: blind foreign,
acceptance::TestLines::test_a_line_rules."""

LINE_HEIGHT = 30.0
"""[times the median power around it] Of a line: the highest of 10000 bins of noise reaches 13. Changed by: blind
none."""

PEAK_HEIGHT = 10.0
"""[the same] Of a line of the drive, and of ringing in averaged spectra, whose noise is lower. Changed by:
acceptance::TestSpectra::test_height_of_a_line_of_the_drive."""

DRIVE_LINE_SHARE = 1e-6
"""[share of the drive's power] A peak of the drive with at least this is a line of its own: an amplitude of a
thousandth. Changed by: acceptance::TestSpectra::test_a_line_of_the_drive."""

CARRIER_SHARE = 0.5
"""[share of the drive's power] A drive with this in one line makes harmonics, even if its swing changes. Changed by:
acceptance::TestSpectra::test_harmonics_of_a_carrier."""

HARMONICS = 10
"""[harmonics] Of that line in the actuator's response. Changed by:
acceptance::TestSpectra::test_harmonics_of_a_carrier."""

LINE_PERIODS = 8
"""[periods] Fewest in a record for a line, and pitches in the travel: trends fill the bins below. Changed by:
acceptance::TestSpectra::test_periods_of_a_line."""

LINE_SAMPLES = 64
"""[samples] Fewest of a record with a line or a period: eight for each of `LINE_PERIODS`. Derived."""

SPECTRUM_SAMPLES = 256
"""[samples] Fewest of a spectrum, and of a ripple: three surroundings of a peak. Changed by:
acceptance::TestSpectra::test_samples_of_a_spectrum."""

SPECTRUM_PARTS = (8, 64)
"""[parts of a record] Whose mean spectra show ringing that fades: of 0.4 to 3 % damping in steps of five seconds. Set
by: disturbances (commit 8380866)."""

SURROUNDINGS, SURROUNDINGS_OF_PARTS = 40, 12
"""[bins] On either side of a peak, in the spectrum of a record and in those of its parts. Changed by:
acceptance::TestSpectra::test_surroundings_of_a_line."""

SAME_BINS = 1.5
"""[bins] Lines closer than this are one: less than the two bins of half a Hann window's main lobe. Derived."""

SAME_RINGING = 0.02
"""[share of the frequency] Ringing closer than this is one start for a resonance. Changed by: blind single."""

SAME_LINE = 0.05
"""[share of the frequency or pitch] A line within this of a stronger one is its remainder. Changed by:
acceptance::TestLines::test_the_rest_of_a_line."""

MOST_LINES = 4
"""[lines] Most lines that are searched for: mains, two harmonics and a ripple. Changed by: blind foreign."""

CRESTS = 5
"""[bins] The highest of a spectrum that are examined, as many as `MOST_LINES` and one of the drive. Derived."""

SEEN_IN = 0.4
"""[share of the records that are long enough] A line is in at least this of them, unless it rules. Changed by:
acceptance::TestLines::test_a_line_in_many_records."""

COMMON_SHARE = 0.6
"""[share of the records, or of the passes] In which a line holds: most. Changed by:
acceptance::TestRipple::test_pitches_of_a_pass."""

STEADY_SHARE = 0.5
"""[share] A line is steady if the phase and amplitude fitted to one half of a record remove at least this of what the
other half's own fit removes. Changed by: acceptance::TestLines::test_a_line_that_fades."""

AMPLITUDE_SAMPLES = 2.2
"""[samples per period] With fewer, the amplitude of a line cannot be seen. Derived: Nyquist's two, and a tenth."""

MAINS_TOLERANCE = 0.002
"""[share of the frequency] A line within this of the mains is hum: 0.1 Hz, twice the band to which the grid is held.
Derived."""

RIPPLE_RESOLVED = 0.25
"""[pitches per sample] A sample shows a ripple if the position moves by less. Derived: four samples per period."""

CONVERTER_STEP = 0.02
"""[share of the pitch] A pitch within this of the smallest step of the output is the converter's. Changed by:
acceptance::TestRipple::test_a_pitch_of_the_converter."""

POSITION_BINS = 4096
"""[bins] Of the range, in which errors are averaged to find a pitch: pitches of a thousandth of it are found. Changed
by: acceptance::TestRipple::test_the_finest_pitch."""

PITCHES = 3
"""[pitches] The highest that are examined. Changed by: acceptance::TestRipple::test_pitches_that_are_examined."""

PASS_SAMPLES, PASS_PITCHES = 32, 3.0
"""[samples], [pitches] Fewest of a pass up or down that confirms a ripple. Changed by:
acceptance::TestRipple::test_pitches_of_a_pass."""

DRIVE_REPEATS = 0.01
"""[share of the drive range, rms] A drive repeats itself if it differs by less from itself a period later: the noise
of a measured drive is less. Changed by: acceptance::TestSpectra::test_a_noisy_drive_repeats."""

DRIVE_AWAY = 0.25
"""[share of the drive range, rms] A period begins once it differed by more. Changed by:
acceptance::TestSpectra::test_a_drive_that_mostly_rests."""

# Stick-slip --------------------------------------------------------------------------------------------------

SLIP_RESOLVED = 7.0
"""[times the noise] Stretches over which the prediction moves by this are examined: noise then makes the output stand
in one of a hundred. Derived."""

SLIP_STRETCH = 0.5, 3.0
"""[times that] Least and most motion of a stretch that counts. Changed by:
acceptance::TestStickSlip::test_how_much_stands."""

SLIP_OFF = 0.6
"""[share of the predicted motion] The output stands if it moves less by this share, and leaps if it moves more by it.
Changed by: acceptance::TestStickSlip::test_how_much_stands."""

SLIP_STANDS, SLIP_LEAPS = 0.15, 0.05
"""[share of the stretches] In which the output stands, and leaps, at least. Changed by: blind foreign,
acceptance::TestStickSlip::test_how_much_stands."""

SLIP_CONTINUES = 0.3
"""[correlation] Largest of neighbouring stretches: a lag continues, a leap makes up for the standstill before. Changed
by: acceptance::TestStickSlip::test_what_goes_on."""

SLIP_MOVING = 0.25
"""[share of the upper quartile of moves] A drive that moves less stands. Changed by:
acceptance::TestStickSlip::test_samples_that_hardly_move_do_not_count."""

SLIP_JUMPS = 5
"""[jumps] Fewest of stick-slip; ten times as many samples, and five times as many stretches, have to move. Changed by:
acceptance::TestStickSlip::test_how_many_jumps."""

SLIP_ALONE = 3.0
"""[times the moves around it] Of a jump: the moves of a smooth output, however fast, are about as large as those two to
five samples away. Most jumps are of that kind. Changed by:
acceptance::TestStickSlip::test_a_fast_output_does_not_jump."""

# What drives are like ----------------------------------------------------------------------------------------

REVERSAL = 0.02
"""[share of the drive range] A reversal is at least this large: above the noise of a measured drive. Changed by:
acceptance::TestDrives::test_a_small_turn."""

LOOP_ENDS = 0.1
"""[share of the drive range] Loops are one if their ends lie within this. Changed by: blind poor."""

LOOP_SPEEDS = 1.5
"""[ratio of times] And at one speed up to this. Changed by: blind poor."""

LOOP_STANDS = 0.3
"""[share of the time between turns] A drive that stands still longer holds. Changed by:
acceptance::TestDrives::test_a_loop_that_stands_is_none."""

# How the remaining error is described ------------------------------------------------------------------------

MAIN_SHARE = 0.5
"""[share of the error's variance] A disturbance with at least this is the subject of the verdict's sentence: most of
it. Derived."""

STRETCH_ABOVE_NOISE = 1.5
"""[times the noise floor] A stretch with more is listed: it has a 24th of the samples of a record, and the rms of
coloured noise over so few scatters more than over all. Changed by: blind none."""

FAST_QUANTILE = 0.9
"""[quantile of the rates] A stretch that is faster on average is fast. Changed by:
acceptance::TestStretches::test_above_the_noise."""

RANGE_END, RANGE_END_SHARE = 0.1, 0.6
"""[share of the drive range], [share of a stretch] A stretch that is mostly this near to the ends. Changed by:
acceptance::TestStretches::test_ends_of_the_range."""

VARIABLE_SHARE = 0.1
"""[share of the error's variance] A variable that explains less does not matter. Changed by:
acceptance::TestDescription::test_a_variable_that_matters."""

VARIABLE_BINS = 24
"""[bins] Of a function of one variable. Changed by: acceptance::TestDescription::test_folds."""

FOLD_BLOCKS = 16
"""[blocks] In which samples alternate between fit and test: longer than errors remember. Changed by:
acceptance::TestDescription::test_folds."""

DESCRIBED_SAMPLES = 200
"""[samples] Fewest that describe an error: eight per bin. Derived."""

MEMORY_WINS = 1.25
"""[times] Memory is reported in place of one variable if it explains more by this. Changed by:
acceptance::TestDescription::test_memory_in_place_of_one_variable."""

RATE_FREE_SHARE = 0.75
"""[share] An error is rate-free if drive and memory explain this of what they explain with rates. Changed by:
acceptance::TestDescription::test_rate_free."""

REPEATABLE_SHARE = 0.5
"""[share of the error's variance] That returns with the drive, for an error to be repeatable: most. Derived."""

PARITY_BINS, PARITY_SAMPLES = 20, 10
"""[bins], [samples] Of the drive's range, and more than this in each, for the even share. Changed by:
acceptance::TestDescription::test_parity."""

PARITY_SHARE = 0.05
"""[share of the error's variance] The mean over drive and direction has at least this, or parity means nothing: half of
`VARIABLE_SHARE`. Derived."""
