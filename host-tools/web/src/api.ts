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
diagnosis: Diagnosis | null, };

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
tour: Tour | null, };

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

export type Changed = { 
/**
 * The revision after it.
 */
revision: number, };
