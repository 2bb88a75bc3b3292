//! What a description says, in words: the catalogue of `greyrig effects` and the pages of the handbook are made of
//! these.

use clap::ValueEnum;
use greyrig::effects::{Acts, Description, EffectId, Relative, Seen, Sentence};

use crate::model::Kind;

/// Which equation an effect enters, in words.
pub fn enters(d: &Description) -> &'static str {
    match d.acts {
        Acts::Electrical => "voltage",
        Acts::Mechanical => "torque",
        Acts::Both => "voltage and torque",
        Acts::Measuring => "measuring chain",
    }
}

/// The effect that another one turns into, and with which shape.
pub fn turns_into(d: &Description) -> Option<(EffectId, String)> {
    let turn = d.turns_into?;
    let p = &d.parameters[turn.parameter];
    Some((turn.into, format!("`{}` beyond {} %{}", p.name, 100.0 * turn.beyond, relative(p.relative))))
}

/// How an effect shows, in words.
pub fn shows(d: &Description) -> String {
    match d.seen {
        Seen::FreeRun => "in the error of the free run".to_owned(),
        Seen::Invisible(needs) => format!("not in voltage, current and speed: needs {needs}"),
        Seen::InvisibleInSeries(needs) => {
            format!("in the error of the free run, with magnets; not in a series motor: needs {needs}")
        }
        Seen::Variance => "in the variance of the residual".to_owned(),
        Seen::Orders => "in lines at multiples of the rotation, above the filter".to_owned(),
        Seen::Course => "in what a model with constant parameters leaves before and after an instant".to_owned(),
        Seen::Samples => "in the samples, before any fit".to_owned(),
    }
}

/// The kinds of motor in which a diagnosis tries an effect.
pub fn diagnosed_in(d: &Description) -> Vec<Kind> {
    Kind::value_variants().iter().copied().filter(|kind| d.is_tried(kind.flux_law())).collect()
}

/// The same in words.
pub fn tried(d: &Description) -> String {
    match diagnosed_in(d)[..] {
        [] => "in no motor".to_owned(),
        [kind] => format!("in {kind} motors"),
        _ => "in all motors".to_owned(),
    }
}

/// What the size of an effect means, with its name for a figure.
pub fn size(d: &Description) -> String {
    Sentence(d.size_in_words, d.size().name).to_string()
}

/// What a recording has to hold, in words.
pub fn excited_by(d: &Description) -> String {
    match d.excited_by {
        [] => "nothing that these three channels hold".to_owned(),
        all => all.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
    }
}

/// On how many rigs it is to be expected, in words.
pub fn prior(d: &Description) -> String {
    format!("on one rig in {:.0}: {}", 1.0 / d.prior.share, d.prior.because)
}

/// What a start value is relative to, in words.
pub fn relative(relative: Relative) -> &'static str {
    match relative {
        Relative::Absolute => "",
        Relative::Current => " of the largest current",
        Relative::InverseCurrentSquared => " over the largest current squared",
        Relative::InverseHeat => " over the integral of the squared current",
        Relative::Voltage => " of the largest voltage",
        Relative::Impedance => " of voltage over current",
        Relative::ImpedancePerSpeed => " of voltage over current and speed",
        Relative::Speed => " of the largest speed",
        Relative::SpeedRootCurrent => " times the largest speed and the root of the largest current",
        Relative::InverseSpeed => " over the largest speed",
        Relative::InverseSpeedSquared => " over the largest speed squared",
        Relative::Friction => " of a tenth of the largest torque",
        Relative::FrictionPerSpeed => " of that over the speed",
        Relative::FrictionPerSpeedSquared => " of that over the speed squared",
        Relative::FrictionPerCurrentSquaredSpeed => " of that over current squared and speed",
        Relative::FrictionPerCurrentSquaredSpeedSquared => " of that over current squared and speed squared",
    }
}

/// The text with its first letter in upper case.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
