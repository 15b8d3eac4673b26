"""Blind plants: records of actuators with known faults, for judging `hystgen diagnose` from outside.

`python -m benchmarks.plants generate | run | score` makes cases, has them diagnosed through the command line and scores
the answers; `make blind` does all three for the report block of seeds. Nothing here imports the package, and only `run`
and `track` call it.

bench, drives, session    the measurement: ranges, rates, waveforms, and the time between the records
base, effects, plant      the actuator, on a time grid eight times finer than the records
measure, foreign          converters and noise; faults that are not effects
refit, rivals             how much a fine play sum absorbs; which names the records leave open
case, labels              the case of a seed, and its files: `cases/` for the workflow, `labels/` for the score
run, score                the package's command line on every case; the figures and their limits

`generate --drives PLAN --holdout FILE ..` drives the plants with records from elsewhere, such as those that
`hystgen diagnose --plan` writes; `--kind single --seeds 0:13` then hides every effect once.

An effect counts as visible if it alone causes an rms residual of at least three times the noise when a fine play sum
and an offset per record are refitted to the noise-free records. Held-out records are never fitted, so an effect that
only they show cannot be found: the held-out records and, after a refit to only these, the records to fit must each show
half of its strength. If five draws do not achieve that (for example, if only the edges of one held-out staircase reach
a slew limit), the closest is kept, and an effect that causes less than half of three times the noise in the records to
fit counts as not visible. A name whose error on the held-out records is at most 5 % larger than that of the plant's
true form is indistinguishable there; for a pair this is decided separately for each effect.
"""
