// Made from host-tools/src/serve/api.rs by its test, with GREYRIG_BLESS=1.

export type Figures = { 
/**
 * Of the current.
 */
current: number | null, 
/**
 * Of the speed.
 */
speed: number | null, 
/**
 * Of the torque, or the force.
 */
torque: number | null, };

export type Role = "fit" | "judge" | "off";

export type Finding = { 
/**
 * `info`, `warning` or `stop`.
 */
severity: string, 
/**
 * The channel, where it is one.
 */
channel: string | null, 
/**
 * Where it begins, s.
 */
from_s: number | null, 
/**
 * Where it ends, s.
 */
to_s: number | null, 
/**
 * In words.
 */
text: string, 
/**
 * The option that mends it.
 */
remedy: string | null, };

export type Signal = { 
/**
 * The column: `u_v`, `i_a`, ….
 */
column: string, 
/**
 * Its unit.
 */
unit: string, };

export type Recording = { 
/**
 * Its number, which no other recording ever gets.
 */
id: number, 
/**
 * As the user knows it.
 */
name: string, 
/**
 * What it is for.
 */
role: Role, 
/**
 * Whether models are judged on it, or on a part of it.
 */
judges: boolean, 
/**
 * Why it cannot be used.
 */
unusable: string | null, 
/**
 * Its first sample, s.
 */
start_s: number, 
/**
 * Duration, s.
 */
seconds: number, 
/**
 * Sampling interval, s.
 */
sample_time_s: number, 
/**
 * Number of samples.
 */
samples: number, 
/**
 * What was measured.
 */
channels: Array<Signal>, 
/**
 * Period of the mains, s; none on DC.
 */
mains_s: number | null, 
/**
 * Rules of `--map`.
 */
map: Array<string>, 
/**
 * What the reader has to say.
 */
warnings: Array<string>, 
/**
 * What is wrong with it.
 */
findings: Array<Finding>, };

export type Parameter = { 
/**
 * Name.
 */
name: string, 
/**
 * Value.
 */
value: number | null, 
/**
 * Unit.
 */
unit: string, 
/**
 * 95 % interval.
 */
ci95: [number, number] | null, 
/**
 * Whether the recordings determine it.
 */
identifiable: boolean, };

export type Candidate = { 
/**
 * Its name in the catalogue.
 */
effect: string, 
/**
 * Step of the diagnosis, from 1.
 */
step: number, 
/**
 * By how much the error on data held out falls.
 */
gain: number, 
/**
 * Chance that it is what is missing.
 */
probability: number | null, 
/**
 * Error in free run with it.
 */
esr_after: Figures, 
/**
 * Why it does not count.
 */
objection: string | null, 
/**
 * Error on data held out of the model with it, once that is there to be looked at.
 */
predicted: Figures | null, };

export type Diagnosis = { 
/**
 * In a line.
 */
headline: string, 
/**
 * How sure, as odds.
 */
odds: string | null, 
/**
 * How sure, as a probability.
 */
probability: number | null, 
/**
 * `missing_effect`, `none`, `ambiguous`, `outside_catalogue` or `insufficient_data`.
 */
kind: string, 
/**
 * What to add, in this order.
 */
effects: Array<string>, 
/**
 * Effects that no recording separates.
 */
classes: Array<Array<string>>, 
/**
 * In a motor engineer's words.
 */
text: string, 
/**
 * What is left that no verdict names, in words: such as an acquittal far above the noise of the sensors.
 */
remaining: string | null, 
/**
 * The recording that would tell more.
 */
next_experiment: string | null, 
/**
 * Best gain of a decoy: what is below it is chance.
 */
decoy_gain: number, 
/**
 * What was tried, best first.
 */
candidates: Array<Candidate>, 
/**
 * The recordings that it rests on.
 */
basis: string, 
/**
 * The command that does the same.
 */
command: string, };

export type Take = { 
/**
 * Profile of the rig.
 */
profile: string, 
/**
 * Length, s.
 */
seconds: number, 
/**
 * Peak voltage, V.
 */
peak_voltage_v: number, 
/**
 * Peak current of the model, A.
 */
peak_current_a: number, };

export type Proposal = { 
/**
 * One or two.
 */
takes: Array<Take>, 
/**
 * What remains of the effect that is harder to tell, in multiples of the noise.
 */
separation: number, };

export type Contest = { 
/**
 * The effects.
 */
rivals: [string, string], 
/**
 * What the catalogue says.
 */
separated_by: string, 
/**
 * Best first.
 */
proposals: Array<Proposal>, };

export type Plan = { 
/**
 * Largest voltage, V.
 */
voltage_v: number, 
/**
 * Largest current, A.
 */
current_a: number, 
/**
 * Pair by pair.
 */
contests: Array<Contest>, 
/**
 * The recordings that tell most over all pairs.
 */
best: Array<Take>, 
/**
 * The command that does the same.
 */
command: string, 
/**
 * The commands that make the best recordings on the virtual rig.
 */
rehearsal: string | null, };

export type Challenged = { 
/**
 * The effect.
 */
effect: string, 
/**
 * The field's name of it.
 */
name: string, 
/**
 * Unit of its size.
 */
unit: string, 
/**
 * Smallest size at which diagnosis names it.
 */
revealed_from: number | null, 
/**
 * Largest size tried at which it does not.
 */
hidden_up_to: number | null, 
/**
 * What that adds to the error in free run.
 */
esr: Figures, 
/**
 * What diagnosis names in its place at the largest hidden size.
 */
mistaken_for: string | null, 
/**
 * Why diagnosis does not name it there.
 */
objection: string | null, };

export type OutOfReach = { 
/**
 * The effect.
 */
effect: string, 
/**
 * The field's name of it.
 */
name: string, 
/**
 * What it takes instead.
 */
text: string, };

export type Challenge = { 
/**
 * What diagnosis finds without any challenge.
 */
found: Array<string>, 
/**
 * Whether structure is left that no effect explains, which hides small effects.
 */
unexplained: boolean, 
/**
 * Effect by effect.
 */
effects: Array<Challenged>, 
/**
 * The others.
 */
out_of_reach: Array<OutOfReach>, 
/**
 * The recordings that it rests on.
 */
basis: string, 
/**
 * The command that does the same.
 */
command: string, };

export type Lines = { 
/**
 * Name and unit of the axis.
 */
x: string, 
/**
 * Name and unit of the values.
 */
y: string, 
/**
 * Each a path.
 */
curves: Array<Locus>, };

export type Surface = { 
/**
 * Input across, and its range.
 */
x: string, 
/**
 * Range across.
 */
x_range: [number, number], 
/**
 * Input up.
 */
y: string, 
/**
 * Range up.
 */
y_range: [number, number], 
/**
 * Cells in a row.
 */
columns: number, 
/**
 * Row by row, from the lower left.
 */
values: Array<number>, };

export type Correction = { 
/**
 * What it does, in a sentence.
 */
text: string, 
/**
 * Whether the error falls on data held out.
 */
accepted: boolean, 
/**
 * Error over the epochs.
 */
learning: Lines, 
/**
 * Membership functions of each input, before and after.
 */
memberships: Array<[Lines, Lines]>, 
/**
 * Its response.
 */
surfaces: Array<Surface>, };

export type Version = { 
/**
 * Its number, which no other version ever gets.
 */
id: number, 
/**
 * What it was made from.
 */
parent: number | null, 
/**
 * What it has got last.
 */
label: string, 
/**
 * The command that makes the same.
 */
command: string, 
/**
 * Effects that it has.
 */
effects: Array<string>, 
/**
 * Terms of the user's own.
 */
terms: Array<string>, 
/**
 * Parameters with their intervals.
 */
parameters: Array<Parameter>, 
/**
 * What the identification has to say.
 */
notes: Array<string>, 
/**
 * What the user has to say.
 */
note: string | null, 
/**
 * Error-to-signal ratio on the data that a fit of the training data has seen.
 */
training: Figures, 
/**
 * The same on the data held out from it.
 */
held_out: Figures, 
/**
 * Noise floor of these.
 */
floor: Figures, 
/**
 * Whether the error on data held out falls by what it has got last.
 */
accepted: boolean | null, 
/**
 * The recordings that it rests on, and what they were for.
 */
basis: string, 
/**
 * The answer to what it lacks.
 */
diagnosis: Diagnosis | null, 
/**
 * Whether it has learnt a correction of what the physics leaves over.
 */
corrected: boolean | null, 
/**
 * What recordings would tell rivals apart.
 */
plan: Plan | null, 
/**
 * What these recordings would have shown.
 */
challenge: Challenge | null, };

export type Station = { 
/**
 * As the user knows it.
 */
name: string, 
/**
 * Its file.
 */
path: string, 
/**
 * The motor type.
 */
motor: string | null, 
/**
 * Healthy motors that taught it; 0 where its file does not tell.
 */
motors: number, 
/**
 * Their runs.
 */
runs: number, 
/**
 * Share of healthy motors that the limits are to hold, and the confidence in that.
 */
holds: [number, number], 
/**
 * Whether it knows the balances of its lot, so that it names faults.
 */
knows_lot: boolean, };

export type Alarm = { 
/**
 * Begin, s.
 */
from_s: number, 
/**
 * End, s.
 */
to_s: number, 
/**
 * `electrical`, `mechanical` or `sensor`.
 */
kind: string, 
/**
 * What called.
 */
cause: string, 
/**
 * What may be broken.
 */
suspect: string, 
/**
 * Largest ratio to the limit.
 */
ratio: number, };

export type Hypothesis = { 
/**
 * In words.
 */
text: string, 
/**
 * `electrical`, `mechanical` or `sensor`.
 */
kind: string, 
/**
 * By how much what it rests on exceeds its limit; none of a cause that is told by what it explains alone.
 */
ratio: number | null, 
/**
 * How many times likelier what explains most is, 1 of that itself.
 */
odds: number | null, 
/**
 * Share of what was seen that it explains.
 */
explains: number, 
/**
 * Whether it is about as likely as the first.
 */
as_likely: boolean, 
/**
 * What to look at on the bench.
 */
look_at: string, };

export type Band = { 
/**
 * From, where there is a lower end.
 */
low: number | null, 
/**
 * To.
 */
high: number, };

export type Course = { 
/**
 * In words.
 */
name: string, 
/**
 * Its unit; empty of a ratio.
 */
unit: string, 
/**
 * Between what healthy motors are; none: it has no limit of its own.
 */
band: Band | null, 
/**
 * Times, s.
 */
t_s: Array<number>, 
/**
 * Its values.
 */
values: Array<number>, };

export type Place = { 
/**
 * In words.
 */
name: string, 
/**
 * Its unit; empty of a ratio.
 */
unit: string, 
/**
 * What the motor shows.
 */
value: number, 
/**
 * Between what healthy motors are.
 */
band: Band, 
/**
 * How far it is from what is usual, as a share of the way to the limit.
 */
ratio: number, };

export type Test = { 
/**
 * Number of the recording.
 */
recording: number, 
/**
 * As the user knows it.
 */
name: string, 
/**
 * Serial number, if the recording tells it.
 */
serial: string | null, 
/**
 * `pass`, `fail` or `cannot judge`.
 */
verdict: string, 
/**
 * Why it cannot be judged.
 */
reasons: Array<string>, 
/**
 * Alarms in time.
 */
alarms: Array<Alarm>, 
/**
 * What may be wrong, the likeliest first.
 */
hypotheses: Array<Hypothesis>, 
/**
 * Where it lies among healthy motors.
 */
places: Array<Place>, 
/**
 * What is watched, over time.
 */
courses: Array<Course>, 
/**
 * Periods that were judged, and all.
 */
periods: [number, number], };

export type Judged = { 
/**
 * Goes up with each judgement.
 */
number: number, 
/**
 * The station that judged.
 */
station: string, 
/**
 * In the order of the recordings.
 */
tests: Array<Test>, 
/**
 * The command that does the same.
 */
command: string, };

export type Job = { 
/**
 * In a word or two.
 */
what: string, 
/**
 * Its present part.
 */
doing: string, 
/**
 * How much of that part is done.
 */
fraction: number | null, 
/**
 * How many parts have begun.
 */
step: number, 
/**
 * How long it has been done, s.
 */
seconds: number, 
/**
 * How long this part will take, s.
 */
left_s: number | null, 
/**
 * Whether it is to stop.
 */
stopping: boolean, };

export type Tour = { 
/**
 * Which.
 */
seed: number, 
/**
 * What it hides.
 */
hidden: Array<string>, };

export type State = { 
/**
 * Layout of this.
 */
schema: number, 
/**
 * Goes up with each change of the project; a change names the one that it rests on.
 */
revision: number, 
/**
 * Goes up with everything that is to be seen.
 */
shown: number, 
/**
 * The project's folder.
 */
project: string, 
/**
 * The recordings.
 */
recordings: Array<Recording>, 
/**
 * What they are, and what for.
 */
basis: string, 
/**
 * The versions.
 */
versions: Array<Version>, 
/**
 * The version that is shown and worked on.
 */
present: number | null, 
/**
 * What is being done.
 */
job: Job | null, 
/**
 * How many candidates are still being simulated.
 */
ahead: number, 
/**
 * What went wrong last.
 */
message: string | null, 
/**
 * All effects of the catalogue.
 */
catalogue: Array<string>, 
/**
 * The command that identifies the base model.
 */
identify: string | null, 
/**
 * The built-in motor, if it is one.
 */
tour: Tour | null, 
/**
 * The kind of motor, by whose rig a plan is limited.
 */
kind: string, 
/**
 * Peak voltage and peak current that a plan keeps to unless it is told otherwise, V and A.
 */
usual_limits: [number, number], 
/**
 * What motors are judged by.
 */
station: Station | null, 
/**
 * Number of the last judgement.
 */
judged: number | null, };

export type Tick = { 
/**
 * As in the state.
 */
revision: number, 
/**
 * As in the state.
 */
shown: number, 
/**
 * As in the state.
 */
job: Job | null, };

export type Axis = { 
/**
 * What it is.
 */
name: string, 
/**
 * Its unit.
 */
unit: string, 
/**
 * Edges of its cells, one more than cells.
 */
edges: Array<number>, };

export type Map = { 
/**
 * Across.
 */
x: Axis, 
/**
 * Up.
 */
y: Axis, 
/**
 * The residual's unit.
 */
unit: string, 
/**
 * Samples in each cell.
 */
counts: Array<number>, 
/**
 * Mean residual, modelled − measured.
 */
mean: Array<number>, 
/**
 * RMS residual.
 */
rms: Array<number>, };

export type Spectrum = { 
/**
 * From one line to the next, Hz or orders.
 */
step: number, 
/**
 * Parts of the time that were averaged.
 */
parts: number, 
/**
 * Root of the power density at 0, step, 2 step …
 */
amplitude: Array<number>, };

export type Correlation = { 
/**
 * First lag, s.
 */
first_s: number, 
/**
 * From one lag to the next, s.
 */
step_s: number, 
/**
 * At this lag and those that follow.
 */
values: Array<number>, 
/**
 * What it exceeds by chance at one lag in a hundred.
 */
bound: number, };

export type Correlations = { 
/**
 * With its own past.
 */
own: Correlation, 
/**
 * With the voltage; positive lags: the residual comes later. None: there is none.
 */
input: Correlation | null, };

export type Locus = { 
/**
 * What it is of.
 */
name: string, 
/**
 * Across.
 */
x: Array<number>, 
/**
 * Up.
 */
y: Array<number>, };

export type LawPlane = { 
/**
 * What it is, in words.
 */
name: string, 
/**
 * Unit across.
 */
x_unit: string, 
/**
 * Unit up.
 */
y_unit: string, 
/**
 * Measured, and of the model.
 */
loci: Array<Locus>, };

export type Changed = { 
/**
 * The revision after it.
 */
revision: number, };
