//! What the page's script is told, and what a project keeps: numbers in SI units, ratios as fractions.
//!
//! The same types in TypeScript are in `host-tools/web/src/api.ts`, which a test below writes and compares.

use serde::{Deserialize, Serialize};

use crate::compare::PerSignal;
use crate::identify::Estimate;
use crate::recording::finding::{DataFinding, Severity};

/// Declares types that the script knows, too.
macro_rules! told {
    ($($(#[$meta:meta])* $kind:ident $name:ident { $($body:tt)* })+) => {
        $(#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(test, derive(ts_rs::TS))]
        $(#[$meta])*
        pub $kind $name { $($body)* })+

        #[cfg(test)]
        fn declarations() -> String {
            use ts_rs::TS;
            [$($name::decl()),+].map(|text| format!("export {text}\n")).join("\n")
        }
    };
}

told! {
    /// A figure for each signal; none where it does not apply.
    #[derive(Copy, Default)]
    struct Figures {
        /// Of the current.
        pub current: Option<f64>,
        /// Of the speed.
        pub speed: Option<f64>,
        /// Of the torque, or the force.
        pub torque: Option<f64>,
    }

    /// What a recording is for.
    #[derive(Copy, Eq)]
    #[serde(rename_all = "lowercase")]
    enum Role {
        /// Models are fitted to it.
        Fit,
        /// What is added is judged on it.
        Judge,
        /// Nothing.
        Off,
    }

    /// What was found about a recording.
    struct Finding {
        /// `info`, `warning` or `stop`.
        pub severity: String,
        /// The channel, where it is one.
        pub channel: Option<String>,
        /// Where it begins, s.
        pub from_s: Option<f64>,
        /// Where it ends, s.
        pub to_s: Option<f64>,
        /// In words.
        pub text: String,
        /// The option that mends it.
        pub remedy: Option<String>,
    }

    /// A channel.
    struct Signal {
        /// The column: `u_v`, `i_a`, ….
        pub column: String,
        /// Its unit.
        pub unit: String,
    }

    /// A recording of the project.
    struct Recording {
        /// Its number, which no other recording ever gets.
        pub id: u32,
        /// As the user knows it.
        pub name: String,
        /// What it is for.
        pub role: Role,
        /// Whether models are judged on it, or on a part of it.
        pub judges: bool,
        /// Why it cannot be used.
        pub unusable: Option<String>,
        /// Its first sample, s.
        pub start_s: f64,
        /// Duration, s.
        pub seconds: f64,
        /// Sampling interval, s.
        pub sample_time_s: f64,
        /// Number of samples.
        pub samples: u32,
        /// What was measured.
        pub channels: Vec<Signal>,
        /// Period of the mains, s; none on DC.
        pub mains_s: Option<f64>,
        /// Rules of `--map`.
        pub map: Vec<String>,
        /// What the reader has to say.
        pub warnings: Vec<String>,
        /// What is wrong with it.
        pub findings: Vec<Finding>,
    }

    /// A parameter of a model.
    struct Parameter {
        /// Name.
        pub name: String,
        /// Value.
        pub value: Option<f64>,
        /// Unit.
        pub unit: String,
        /// 95 % interval.
        pub ci95: Option<[f64; 2]>,
        /// Whether the recordings determine it.
        pub identifiable: bool,
    }

    /// An effect that was tried.
    struct Candidate {
        /// Its name in the catalogue.
        pub effect: String,
        /// Step of the diagnosis, from 1.
        pub step: u32,
        /// By how much the error on data held out falls.
        pub gain: f64,
        /// Chance that it is what is missing.
        pub probability: Option<f64>,
        /// Error in free run with it.
        pub esr_after: Figures,
        /// Why it does not count.
        pub objection: Option<String>,
        /// Error on data held out of the model with it, once that is there to be looked at.
        pub predicted: Option<Figures>,
    }

    /// The answer to what is missing.
    struct Diagnosis {
        /// In a line.
        pub headline: String,
        /// How sure, as odds.
        pub odds: Option<String>,
        /// How sure, as a probability.
        pub probability: Option<f64>,
        /// `missing_effect`, `none`, `ambiguous`, `outside_catalogue` or `insufficient_data`.
        pub kind: String,
        /// What to add, in this order.
        pub effects: Vec<String>,
        /// Effects that no recording separates.
        pub classes: Vec<Vec<String>>,
        /// In a motor engineer's words.
        pub text: String,
        /// What is left that no verdict names, in words: such as an acquittal far above the noise of the sensors.
        pub remaining: Option<String>,
        /// The recording that would tell more.
        pub next_experiment: Option<String>,
        /// Best gain of a decoy: what is below it is chance.
        pub decoy_gain: f64,
        /// What was tried, best first.
        pub candidates: Vec<Candidate>,
        /// The recordings that it rests on.
        pub basis: String,
        /// The command that does the same.
        pub command: String,
    }

    /// A recording to be made.
    struct Take {
        /// Profile of the rig.
        pub profile: String,
        /// Length, s.
        pub seconds: f64,
        /// Peak voltage, V.
        pub peak_voltage_v: f64,
        /// Peak current of the model, A.
        pub peak_current_a: f64,
    }

    /// Recordings, and how well they tell two rivals apart.
    struct Proposal {
        /// One or two.
        pub takes: Vec<Take>,
        /// What remains of the effect that is harder to tell, in multiples of the noise.
        pub separation: f64,
    }

    /// Two rivals, and the proposals for them.
    struct Contest {
        /// The effects.
        pub rivals: [String; 2],
        /// What the catalogue says.
        pub separated_by: String,
        /// Best first.
        pub proposals: Vec<Proposal>,
    }

    /// What recordings would tell rivals apart.
    struct Plan {
        /// Largest voltage, V.
        pub voltage_v: f64,
        /// Largest current, A.
        pub current_a: f64,
        /// Pair by pair.
        pub contests: Vec<Contest>,
        /// The recordings that tell most over all pairs.
        pub best: Vec<Take>,
        /// The command that does the same.
        pub command: String,
        /// The commands that make the best recordings on the virtual rig.
        pub rehearsal: Option<String>,
    }

    /// What one effect would have done.
    struct Challenged {
        /// The effect.
        pub effect: String,
        /// The field's name of it.
        pub name: String,
        /// Unit of its size.
        pub unit: String,
        /// Smallest size at which diagnosis names it.
        pub revealed_from: Option<f64>,
        /// Largest size tried at which it does not.
        pub hidden_up_to: Option<f64>,
        /// What that adds to the error in free run.
        pub esr: Figures,
        /// What diagnosis names in its place at the largest hidden size.
        pub mistaken_for: Option<String>,
        /// Why diagnosis does not name it there.
        pub objection: Option<String>,
    }

    /// An effect that these recordings cannot tell.
    struct OutOfReach {
        /// The effect.
        pub effect: String,
        /// The field's name of it.
        pub name: String,
        /// What it takes instead.
        pub text: String,
    }

    /// From what size on the recordings would have revealed each effect.
    struct Challenge {
        /// What diagnosis finds without any challenge.
        pub found: Vec<String>,
        /// Whether structure is left that no effect explains, which hides small effects.
        pub unexplained: bool,
        /// Effect by effect.
        pub effects: Vec<Challenged>,
        /// The others.
        pub out_of_reach: Vec<OutOfReach>,
        /// The recordings that it rests on.
        pub basis: String,
        /// The command that does the same.
        pub command: String,
    }

    /// Curves over one axis.
    struct Lines {
        /// Name and unit of the axis.
        pub x: String,
        /// Name and unit of the values.
        pub y: String,
        /// Each a path.
        pub curves: Vec<Locus>,
    }

    /// What a network answers over two of its inputs.
    struct Surface {
        /// Input across, and its range.
        pub x: String,
        /// Range across.
        pub x_range: [f64; 2],
        /// Input up.
        pub y: String,
        /// Range up.
        pub y_range: [f64; 2],
        /// Cells in a row.
        pub columns: u32,
        /// Row by row, from the lower left.
        pub values: Vec<f64>,
    }

    /// What was learnt of what the physics leaves over.
    struct Correction {
        /// What it does, in a sentence.
        pub text: String,
        /// Whether the error falls on data held out.
        pub accepted: bool,
        /// Error over the epochs.
        pub learning: Lines,
        /// Membership functions of each input, before and after.
        pub memberships: Vec<[Lines; 2]>,
        /// Its response.
        pub surfaces: Vec<Surface>,
    }

    /// A version of the model.
    struct Version {
        /// Its number, which no other version ever gets.
        pub id: u32,
        /// What it was made from.
        pub parent: Option<u32>,
        /// What it has got last.
        pub label: String,
        /// The command that makes the same.
        pub command: String,
        /// Effects that it has.
        pub effects: Vec<String>,
        /// Terms of the user's own.
        pub terms: Vec<String>,
        /// Parameters with their intervals.
        pub parameters: Vec<Parameter>,
        /// What the identification has to say.
        pub notes: Vec<String>,
        /// What the user has to say.
        pub note: Option<String>,
        /// Error-to-signal ratio on the data that a fit of the training data has seen.
        pub training: Figures,
        /// The same on the data held out from it.
        pub held_out: Figures,
        /// Noise floor of these.
        pub floor: Figures,
        /// Whether the error on data held out falls by what it has got last.
        pub accepted: Option<bool>,
        /// The recordings that it rests on, and what they were for.
        pub basis: String,
        /// The answer to what it lacks.
        pub diagnosis: Option<Diagnosis>,
        /// Whether it has learnt a correction of what the physics leaves over.
        pub corrected: Option<bool>,
        /// What recordings would tell rivals apart.
        pub plan: Option<Plan>,
        /// What these recordings would have shown.
        pub challenge: Option<Challenge>,
    }

    /// A model with limits, that motors are judged by.
    struct Station {
        /// As the user knows it.
        pub name: String,
        /// Its file.
        pub path: String,
        /// The motor type.
        pub motor: Option<String>,
        /// Healthy motors that taught it; 0 where its file does not tell.
        pub motors: u32,
        /// Their runs.
        pub runs: u32,
        /// Share of healthy motors that the limits are to hold, and the confidence in that.
        pub holds: [f64; 2],
        /// Whether it knows the balances of its lot, so that it names faults.
        pub knows_lot: bool,
    }

    /// An alarm, from its first period to its last.
    struct Alarm {
        /// Begin, s.
        pub from_s: f64,
        /// End, s.
        pub to_s: f64,
        /// `electrical`, `mechanical` or `sensor`.
        pub kind: String,
        /// What called.
        pub cause: String,
        /// What may be broken.
        pub suspect: String,
        /// Largest ratio to the limit.
        pub ratio: f64,
    }

    /// What may be wrong with a motor.
    struct Hypothesis {
        /// In words.
        pub text: String,
        /// `electrical`, `mechanical` or `sensor`.
        pub kind: String,
        /// By how much what it rests on exceeds its limit; none of a cause that is told by what it explains alone.
        pub ratio: Option<f64>,
        /// How many times likelier what explains most is, 1 of that itself.
        pub odds: Option<f64>,
        /// Share of what was seen that it explains.
        pub explains: f64,
        /// Whether it is about as likely as the first.
        pub as_likely: bool,
        /// What to look at on the bench.
        pub look_at: String,
    }

    /// What healthy motors show.
    #[derive(Copy)]
    struct Band {
        /// From, where there is a lower end.
        pub low: Option<f64>,
        /// To.
        pub high: f64,
    }

    /// Something that is watched over the time of a test.
    struct Course {
        /// In words.
        pub name: String,
        /// Its unit; empty of a ratio.
        pub unit: String,
        /// Between what healthy motors are; none: it has no limit of its own.
        pub band: Option<Band>,
        /// Times, s.
        pub t_s: Vec<f64>,
        /// Its values.
        pub values: Vec<f64>,
    }

    /// A figure of a motor among those of healthy ones.
    struct Place {
        /// In words.
        pub name: String,
        /// Its unit; empty of a ratio.
        pub unit: String,
        /// What the motor shows.
        pub value: f64,
        /// Between what healthy motors are.
        pub band: Band,
        /// How far it is from what is usual, as a share of the way to the limit.
        pub ratio: f64,
    }

    /// A motor that has been judged.
    struct Test {
        /// Number of the recording.
        pub recording: u32,
        /// As the user knows it.
        pub name: String,
        /// Serial number, if the recording tells it.
        pub serial: Option<String>,
        /// `pass`, `fail` or `cannot judge`.
        pub verdict: String,
        /// Why it cannot be judged.
        pub reasons: Vec<String>,
        /// Alarms in time.
        pub alarms: Vec<Alarm>,
        /// What may be wrong, the likeliest first.
        pub hypotheses: Vec<Hypothesis>,
        /// Where it lies among healthy motors.
        pub places: Vec<Place>,
        /// What is watched, over time.
        pub courses: Vec<Course>,
        /// Periods that were judged, and all.
        pub periods: [u32; 2],
    }

    /// Motors that have been judged.
    struct Judged {
        /// Goes up with each judgement.
        pub number: u32,
        /// The station that judged.
        pub station: String,
        /// In the order of the recordings.
        pub tests: Vec<Test>,
        /// The command that does the same.
        pub command: String,
    }

    /// What is being done.
    struct Job {
        /// In a word or two.
        pub what: String,
        /// Its present part.
        pub doing: String,
        /// How much of that part is done.
        pub fraction: Option<f64>,
        /// How many parts have begun.
        pub step: u32,
        /// How long it has been done, s.
        pub seconds: f64,
        /// How long this part will take, s.
        pub left_s: Option<f64>,
        /// Whether it is to stop.
        pub stopping: bool,
    }

    /// A motor of the virtual rig that hides something.
    struct Tour {
        /// Which.
        pub seed: u32,
        /// What it hides.
        pub hidden: Vec<String>,
    }

    /// Everything that the page shows but signals and maps.
    struct State {
        /// Layout of this.
        pub schema: u32,
        /// Goes up with each change of the project; a change names the one that it rests on.
        pub revision: u32,
        /// Goes up with everything that is to be seen.
        pub shown: u32,
        /// The project's folder.
        pub project: String,
        /// The recordings.
        pub recordings: Vec<Recording>,
        /// What they are, and what for.
        pub basis: String,
        /// The versions.
        pub versions: Vec<Version>,
        /// The version that is shown and worked on.
        pub present: Option<u32>,
        /// What is being done.
        pub job: Option<Job>,
        /// How many candidates are still being simulated.
        pub ahead: u32,
        /// What went wrong last.
        pub message: Option<String>,
        /// All effects of the catalogue.
        pub catalogue: Vec<String>,
        /// The command that identifies the base model.
        pub identify: Option<String>,
        /// The built-in motor, if it is one.
        pub tour: Option<Tour>,
        /// The kind of motor, by whose rig a plan is limited.
        pub kind: String,
        /// Peak voltage and peak current that a plan keeps to unless it is told otherwise, V and A.
        pub usual_limits: [f64; 2],
        /// What motors are judged by.
        pub station: Option<Station>,
        /// Number of the last judgement.
        pub judged: Option<u32>,
    }

    /// What the stream of events tells.
    struct Tick {
        /// As in the state.
        pub revision: u32,
        /// As in the state.
        pub shown: u32,
        /// As in the state.
        pub job: Option<Job>,
    }

    /// An axis of a map.
    struct Axis {
        /// What it is.
        pub name: String,
        /// Its unit.
        pub unit: String,
        /// Edges of its cells, one more than cells.
        pub edges: Vec<f64>,
    }

    /// Residual over a plane; cells row by row, a row per cell of `y`.
    struct Map {
        /// Across.
        pub x: Axis,
        /// Up.
        pub y: Axis,
        /// The residual's unit.
        pub unit: String,
        /// Samples in each cell.
        pub counts: Vec<u32>,
        /// Mean residual, modelled − measured.
        pub mean: Vec<f64>,
        /// RMS residual.
        pub rms: Vec<f64>,
    }

    /// What is in a signal at each frequency, or order.
    struct Spectrum {
        /// From one line to the next, Hz or orders.
        pub step: f64,
        /// Parts of the time that were averaged.
        pub parts: u32,
        /// Root of the power density at 0, step, 2 step …
        pub amplitude: Vec<f64>,
    }

    /// A correlation at equal lags.
    struct Correlation {
        /// First lag, s.
        pub first_s: f64,
        /// From one lag to the next, s.
        pub step_s: f64,
        /// At this lag and those that follow.
        pub values: Vec<f64>,
        /// What it exceeds by chance at one lag in a hundred.
        pub bound: f64,
    }

    /// What a residual has to do with its past and with the voltage.
    struct Correlations {
        /// With its own past.
        pub own: Correlation,
        /// With the voltage; positive lags: the residual comes later. None: there is none.
        pub input: Option<Correlation>,
    }

    /// A path in a plane.
    struct Locus {
        /// What it is of.
        pub name: String,
        /// Across.
        pub x: Vec<f64>,
        /// Up.
        pub y: Vec<f64>,
    }

    /// A plane in which a motor's laws are drawn.
    struct LawPlane {
        /// What it is, in words.
        pub name: String,
        /// Unit across.
        pub x_unit: String,
        /// Unit up.
        pub y_unit: String,
        /// Measured, and of the model.
        pub loci: Vec<Locus>,
    }

    /// What a change has made.
    struct Changed {
        /// The revision after it.
        pub revision: u32,
    }
}

impl From<PerSignal> for Figures {
    fn from(p: PerSignal) -> Self {
        Self { current: p.current, speed: p.speed, torque: p.torque }
    }
}

impl From<&Estimate> for Parameter {
    fn from(e: &Estimate) -> Self {
        Self { name: e.name.clone(), value: e.value, unit: e.unit.clone(), ci95: e.ci95, identifiable: e.identifiable }
    }
}

impl From<&DataFinding> for Finding {
    fn from(f: &DataFinding) -> Self {
        let severity = match f.severity {
            Severity::Info => "info",
            Severity::Warning => "warning",
            Severity::Stop => "stop",
        };
        Self {
            severity: severity.to_owned(),
            channel: f.channel.map(|c| c.column().to_owned()),
            from_s: f.from_s,
            to_s: f.to_s,
            text: f.text.clone(),
            remedy: f.remedy.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With `GREYRIG_BLESS` set the file is written.
    #[test]
    fn the_script_knows_these_types() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("web/src/api.ts");
        let text = format!(
            "// Made from host-tools/src/serve/api.rs by its test, with GREYRIG_BLESS=1.\n\n{}",
            declarations()
        );
        if std::env::var_os("GREYRIG_BLESS").is_some() {
            std::fs::write(&file, &text).expect("the types are written");
        }
        let kept = std::fs::read_to_string(&file).expect("the types");
        assert!(kept == text, "{} is behind: run this test with GREYRIG_BLESS=1", file.display());
    }
}
