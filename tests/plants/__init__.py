"""Blind plants: records of actuators with known faults, for judging `hystgen diagnose` from outside.

`python -m tests.plants generate | run | score` makes cases, has them diagnosed through the command line, and counts;
`make blind` does all three with the report block of seeds. Nothing here imports the package, and only `run` and `track`
call it.

bench, drives, session    who measures what: ranges, rates, waveforms, what happens between the records
base, effects, plant      the actuator, on a time grid eight times finer than the records
measure, foreign          converters and noise; faults that are no effect
refit, rivals             how much a fine play sum swallows; which names the records leave open
case, labels              what a seed gives, and its files: `cases/` for the workflow, `labels/` for the score
run, score                the package's command line on every case; the figures and their limits

`generate --drives PLAN --holdout FILE ..` drives the plants with records that somebody else has made, such as those
that `hystgen diagnose --plan` writes; `--kind single --seeds 0:13` then hides every effect once.

An effect counts as visible from three times the noise on, by the rms that it alone leaves when a fine play sum and an
offset a record are refitted to the noise-free records. Held-out records are never fitted, so that what they alone show
cannot be found: of its strength at least half is wanted in the held-out records and, after a refit to these alone, in
the records to fit. Where five draws do not make that (a slew limit that is met by the edges of one held-out staircase
only) the nearest is kept, and an effect that leaves less than half of three times the noise in the records to fit
counts as not visible. A name that leaves at most 5 % more on the held-out records
than the plant's true form is indistinguishable there; for a pair this is settled for each effect alone.
"""
