//! The variables of a unit, as its description has them.

use greyrig::exchange::Variable;
use greyrig::motor::{BaseParameter, MAX_TERMS};
use greyrig::parameters::Settings;

use crate::model::{Model, unit};

/// What a simulator does with a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// The time.
    Independent,
    /// It sets it while it steps.
    Input,
    /// It reads it.
    Output,
    /// It can set it before the first step.
    Parameter,
}

impl Causality {
    /// As both versions of the interface write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Input => "input",
            Self::Output => "output",
            Self::Parameter => "parameter",
        }
    }

    /// Its variability, likewise.
    pub const fn variability(self) -> &'static str {
        match self {
            Self::Parameter => "fixed",
            _ => "continuous",
        }
    }
}

/// A variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Described {
    /// Which one it is.
    pub variable: Variable,
    /// Its name: that of the recordings and of the model file.
    pub name: String,
    /// What it is.
    pub meaning: String,
    /// What a simulator does with it.
    pub causality: Causality,
    /// Its unit; none where the model does not know it.
    pub unit: Option<&'static str>,
    /// The value that it has if nobody sets it.
    pub start: Option<f64>,
    /// Smallest and largest value that it may have.
    pub range: Option<(f64, f64)>,
}

/// All variables of a model.
pub fn of(model: &Model, settings: &Settings) -> Vec<Described> {
    let in_motion = |rotary: &'static str| unit(rotary, model.motion);
    let signal = |variable, name: &str, meaning: &str, causality, rotary, start| Described {
        variable,
        name: name.to_owned(),
        meaning: meaning.to_owned(),
        causality,
        unit: Some(in_motion(rotary)),
        start,
        range: None,
    };
    let mut all = vec![
        signal(Variable::Time, "time", "time", Causality::Independent, "s", None),
        signal(
            Variable::Voltage,
            "u_v",
            "supply voltage, held within a communication step",
            Causality::Input,
            "V",
            Some(0.0),
        ),
    ];
    if settings.terms.len() < MAX_TERMS {
        let meaning = "load that brakes a motion in the positive direction, held within a communication step";
        all.push(signal(Variable::Load, "load_n_m", meaning, Causality::Input, "N m", Some(0.0)));
    }
    all.extend([
        signal(Variable::Current, "i_a", "current, as it is measured", Causality::Output, "A", None),
        signal(Variable::Speed, "omega_rad_s", "speed, as it is measured", Causality::Output, "rad/s", None),
        signal(
            Variable::Torque,
            "torque_n_m",
            "what current and flux drive with, before friction",
            Causality::Output,
            "N m",
            None,
        ),
        signal(Variable::StartCurrent, "i_a_start", "current at the begin", Causality::Parameter, "A", Some(0.0)),
        signal(
            Variable::StartSpeed,
            "omega_rad_s_start",
            "speed at the begin",
            Causality::Parameter,
            "rad/s",
            Some(0.0),
        ),
    ]);
    let mut parameter = |variable: Variable, name: String, meaning: &str, unit, range| {
        all.push(Described {
            variable,
            name,
            meaning: meaning.to_owned(),
            causality: Causality::Parameter,
            unit,
            start: variable.value(settings).map(decimal),
            range,
        });
    };
    for base in BaseParameter::ALL {
        let unit = in_motion(base.unit(model.kind.flux_law()));
        parameter(Variable::Base(base), base.name().to_owned(), meaning(base), Some(unit), Some(base.range()));
    }
    for (place, effect) in settings.effects.iter().enumerate() {
        let description = effect.description();
        for (k, p) in description.parameters.iter().enumerate() {
            let name = format!("{}.{}", description.id, p.name);
            let variable = Variable::Effect { place, parameter: k };
            parameter(variable, name, p.meaning, Some(in_motion(p.unit)), Some(p.range));
        }
    }
    for (place, term) in model.terms.iter().enumerate() {
        for (unknown, name) in term.formula.unknowns().iter().enumerate() {
            let variable = Variable::Term { place, unknown };
            let meaning = format!("constant of the term {}", term.formula.text());
            parameter(variable, format!("term{}.{name}", place + 1), &meaning, None, None);
        }
    }
    all
}

const fn meaning(parameter: BaseParameter) -> &'static str {
    match parameter {
        BaseParameter::R => "resistance",
        BaseParameter::L => "inductance",
        BaseParameter::K => "flux coefficient",
        BaseParameter::J => "inertia",
        BaseParameter::Mu0 => "dry friction",
        BaseParameter::Mu1 => "viscous friction",
        BaseParameter::Mu2 => "turbulent friction",
    }
}

/// The shortest decimal number that is this one in single precision, with which the model runs.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}
