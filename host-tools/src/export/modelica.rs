//! The model as Modelica text: the equations that were identified, to be read, changed and simulated elsewhere.
//!
//! Effects whose law is a formula of current, speed and voltage have one here; effects that remember, and a learned
//! correction, have none, and are refused. The formulas are those of [`greyrig::effects`], written anew: a test holds
//! each against the core's own balance.
//!
//! Dry friction is set-valued at rest, which the core decides step by step. Here it rises in proportion below a small
//! speed, a parameter of the model, so that every simulator can integrate it: a rotor at rest creeps under a load.

use std::path::Path;

use greyrig::effects::{Effect, EffectId};
use greyrig::exchange::Variable;
use greyrig::motor::{BaseParameter, FluxLaw};
use greyrig::parameters::Settings;
use greyrig::term::{Op, Target, Term};

use super::variables::{self, Causality};
use crate::error::{Error, Place, Result};
use crate::model::Model;
use crate::recording::Motion;

/// Speed below which dry friction rises in proportion, rad/s or m/s. Judgement: a rotor that creeps at it takes a
/// minute for a hundredth of a turn.
const REST: &str = "1e-3";

/// What the balances of voltage and torque are made of, as formulas of `i`, `omega` and `u`.
#[derive(Debug, Clone, PartialEq)]
struct Formulas {
    magnetising: String,
    flux: String,
    supply: String,
    resistance: String,
    inductance: String,
    voltage: String,
    torque: String,
    dry_friction: String,
    viscous_friction: String,
    turbulent_friction: String,
    friction: String,
    shown_current: String,
    shown_speed: String,
}

impl Formulas {
    fn base() -> Self {
        let [magnetising, flux, supply, none] = ["i", "1", "u", "0"].map(str::to_owned);
        let name = |parameter: BaseParameter| parameter.name().to_owned();
        Self {
            magnetising,
            flux,
            supply,
            resistance: name(BaseParameter::R),
            inductance: name(BaseParameter::L),
            voltage: none.clone(),
            torque: none.clone(),
            dry_friction: name(BaseParameter::Mu0),
            viscous_friction: name(BaseParameter::Mu1),
            turbulent_friction: name(BaseParameter::Mu2),
            friction: none,
            shown_current: "i".to_owned(),
            shown_speed: "omega".to_owned(),
        }
    }

    /// Changes what an effect changes; `None` if its law is no formula.
    fn with(&mut self, effect: EffectId) -> Option<()> {
        match effect {
            EffectId::Remanence => add(&mut self.magnetising, "remanence_current"),
            EffectId::Saturation => {
                let z = format!("({}/saturation_knee)", self.magnetising);
                let q = format!("(1 + saturation_softness*{z}^2 + {z}^4)");
                let slope = format!("(1 - saturation_depth*(1 - (1 + saturation_softness*{z}^2/2)/{q}^1.25))");
                times(&mut self.flux, &format!("(1 - saturation_depth*(1 - {q}^(-0.25)))"));
                // What earlier effects have left of the inductance is all along the path of the flux, or beside it.
                self.inductance = format!("({}*{slope} + L*(1 - saturation_linked)*(1 - {slope}))", self.inductance);
            }
            EffectId::ArmatureReaction => {
                let z = format!("({}/reaction_knee)", self.magnetising);
                times(&mut self.flux, &format!("(1 - reaction_depth*{z}^2/(1 + {z}^2))"));
            }
            EffectId::InductanceSaturation => {
                let z = "(i/inductance_knee)";
                let q = format!("({z}^2 + inductance_sharpness*{z}^4)");
                times(&mut self.inductance, &format!("(1 - inductance_depth*{q}/(1 + {q}))"));
            }
            EffectId::CommutationDemagnetisation => times(&mut self.flux, "(1 - demagnetisation*abs(omega))"),
            EffectId::SkinEffect => times(&mut self.resistance, "(1 + skin_effect*omega^2)"),
            EffectId::CommutationResistance => add(&mut self.resistance, "commutation_resistance*abs(omega)"),
            EffectId::VoltageOffset => add(&mut self.supply, "(-voltage_offset)"),
            EffectId::VoltageGain => times(&mut self.supply, "(1/(1 + voltage_gain))"),
            EffectId::SupplyDeadZone => {
                let u = &self.supply;
                self.supply = format!("({u} - (abs({u} + supply_dead_zone) - abs({u} - supply_dead_zone))/2)");
            }
            EffectId::SupplyImpedance => {
                add(&mut self.resistance, "supply_resistance");
                add(&mut self.inductance, "supply_inductance");
            }
            EffectId::ConverterDeadTime => add(&mut self.voltage, "dead_time_drop*i/(abs(i) + dead_time_ripple)"),
            EffectId::BrushDrop => {
                add(&mut self.voltage, "brush_drop*(1 - exp(-abs(i)/brush_transition))*sign(i)");
            }
            EffectId::CoulombFriction => add(&mut self.dry_friction, "coulomb_friction"),
            EffectId::TorqueOffset => add(&mut self.torque, "(-torque_offset)"),
            EffectId::QuadraticLoad => add(&mut self.turbulent_friction, "quadratic_load"),
            EffectId::StrayLoadTorque => add(&mut self.friction, "stray_load_torque*i^2*omega*abs(omega)"),
            EffectId::CurrentCompression => {
                let i = self.shown_current.clone();
                self.shown_current = format!("({i}/sqrt(1 + 2*current_compression*{i}^2))");
            }
            EffectId::CurrentGain => times(&mut self.shown_current, "(1 + current_gain)"),
            EffectId::CurrentOffset => add(&mut self.shown_current, "current_offset"),
            EffectId::SpeedGain => times(&mut self.shown_speed, "(1 + speed_gain)"),
            _ => return None,
        }
        Some(())
    }

    /// Changes what a term of the user's own changes, whose unknowns have these names.
    fn with_term(&mut self, term: &Term<f32>, names: &[String]) {
        let formula = infix(term, names);
        add(
            match term.target() {
                Target::Voltage => &mut self.voltage,
                Target::Torque => &mut self.friction,
            },
            &formula,
        );
    }
}

fn add(formula: &mut String, further: &str) {
    *formula = if formula == "0" { further.to_owned() } else { format!("({formula} + {further})") };
}

fn times(formula: &mut String, factor: &str) {
    *formula = if formula == "1" { factor.to_owned() } else { format!("{formula}*{factor}") };
}

/// The operations of a term as a formula, every result in brackets.
fn infix(term: &Term<f32>, names: &[String]) -> String {
    let mut stack: Vec<String> = Vec::new();
    for op in term.ops() {
        let x = if op.operands() > 0 { stack.pop().unwrap_or_default() } else { String::new() };
        let w = if op.operands() > 1 { stack.pop().unwrap_or_default() } else { String::new() };
        stack.push(match op {
            Op::Constant(value) => format!("({value})"),
            Op::Unknown(index) => names.get(usize::from(index)).cloned().unwrap_or_default(),
            Op::Current => "i".to_owned(),
            Op::Speed => "omega".to_owned(),
            Op::Voltage => "u".to_owned(),
            Op::Add => format!("({w} + {x})"),
            Op::Sub => format!("({w} - {x})"),
            Op::Mul => format!("({w}*{x})"),
            Op::Div => format!("({w}/{x})"),
            Op::Pow => format!("({w}^{x})"),
            Op::Neg => format!("(-{x})"),
            Op::Abs => format!("abs({x})"),
            Op::Sign => format!("sign({x})"),
            Op::Sqrt => format!("sqrt({x})"),
            Op::Exp => format!("exp({x})"),
            Op::Ln => format!("log({x})"),
            Op::Tanh => format!("tanh({x})"),
            Op::Atan => format!("atan({x})"),
            Op::Sin => format!("sin({x})"),
            Op::Cos => format!("cos({x})"),
            Op::Square => format!("({x}^2)"),
            Op::PowI(power) => format!("({x}^({power}))"),
        });
    }
    stack.pop().unwrap_or_default()
}

/// The name of a term's unknown: no other name of the model ends so.
fn unknown(term: usize, name: &str) -> String {
    format!("{name}_term{}", term + 1)
}

fn formulas(model: &Model, settings: &Settings, path: &Path) -> Result<Formulas> {
    let refuse = |what: String| Error::input(Place::file(path), what, "export an --fmu, which holds the whole model");
    if model.correction.is_some() {
        return Err(refuse("the learned correction is no formula".to_owned()));
    }
    let mut formulas = Formulas::base();
    for id in settings.effects.iter().map(Effect::id) {
        formulas.with(id).ok_or_else(|| refuse(format!("the law of the effect {id} is no formula of the moment")))?;
    }
    for (n, (term, entry)) in settings.terms.iter().zip(&model.terms).enumerate() {
        let names: Vec<String> = entry.formula.unknowns().iter().map(|name| unknown(n, name)).collect();
        formulas.with_term(term, &names);
    }
    Ok(formulas)
}

/// The model as the text of a Modelica class; `path` is where it comes from.
///
/// # Errors
/// A model that a voltage does not drive; an effect whose law is no formula, or a learned correction.
pub fn text(model: &Model, path: &Path) -> Result<String> {
    super::require(model, path)?;
    let settings = super::settings(model, path, super::usual_interval_s())?;
    let f = formulas(model, &settings, path)?;
    let class = class_name(model);
    let mut text = format!(
        "model {class} \"Grey-box model of a {} motor, exported by greyrig {}\"\n  // Dry friction rises in \
         proportion below omega_rest, where the identified model holds the rotor.\n",
        model.kind,
        env!("CARGO_PKG_VERSION")
    );
    let all = variables::of(model, &settings);
    for v in all.iter().filter(|v| v.causality == Causality::Parameter && v.range.is_some() || v.unit.is_none()) {
        let name = match v.variable {
            Variable::Term { place, .. } => unknown(place, v.name.rsplit('.').next().unwrap_or(&v.name)),
            _ => v.name.rsplit('.').next().unwrap_or(&v.name).to_owned(),
        };
        let unit = v.unit.and_then(modelica_unit).map_or_else(String::new, |unit| format!("(unit = \"{unit}\")"));
        let value = v.start.unwrap_or(0.0);
        text += &format!("  parameter Real {name}{unit} = {value:e} \"{}\";\n", v.meaning.replace('"', "'"));
    }
    let speed = if model.motion == Motion::Linear { "m/s" } else { "rad/s" };
    let linkage = match model.kind.flux_law() {
        FluxLaw::Series => "K*flux*magnetising",
        FluxLaw::PermanentMagnet => "K*flux",
    };
    text +=
        &format!("  parameter Real omega_rest(unit = \"{speed}\") = {REST} \"speed below which it counts as rest\";\n");
    text += &format!(
        "  input Real u(unit = \"V\") \"supply voltage\";\n  input Real load \"load that brakes a motion in the positive \
         direction\";\n  output Real i_a(unit = \"A\") \"current, as it is measured\";\n  output Real \
         omega_rad_s(unit = \"{speed}\") \"speed, as it is measured\";\n  Real i(unit = \"A\", start = 0, fixed = \
         true) \"current\";\n  Real omega(unit = \"{speed}\", start = 0, fixed = true) \"speed\";\n"
    );
    text += "protected\n  Real magnetising, flux, linkage, supply, resistance, inductance, voltage, torque;\n  Real \
             dry_friction, friction;\nequation\n";
    let mut friction = f.friction.clone();
    add(&mut friction, &format!("({} + {}*abs(omega))*omega", f.viscous_friction, f.turbulent_friction));
    for (name, formula) in [
        ("magnetising", &f.magnetising),
        ("flux", &f.flux),
        ("linkage", &linkage.to_owned()),
        ("supply", &f.supply),
        ("resistance", &f.resistance),
        ("inductance", &f.inductance),
        ("voltage", &f.voltage),
        ("torque", &f.torque),
        ("dry_friction", &f.dry_friction),
        ("friction", &friction),
        ("i_a", &f.shown_current),
        ("omega_rad_s", &f.shown_speed),
    ] {
        text += &format!("  {name} = {formula};\n");
    }
    text += "  inductance*der(i) = supply - resistance*i - linkage*omega - voltage;\n  J*der(omega) = linkage*i + torque \
             - friction - load\n    - dry_friction*noEvent(if abs(omega) < omega_rest then omega/omega_rest else \
             sign(omega));\n";
    text += &format!("end {class};\n");
    Ok(text)
}

/// A name of the model that Modelica takes for an identifier.
fn class_name(model: &Model) -> String {
    let name = model.motor.as_deref().unwrap_or(model.kind.name());
    let letters: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    match letters.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => letters,
        false => format!("Motor_{letters}"),
    }
}

/// A unit in Modelica's spelling; none where an exponent is no whole number.
fn modelica_unit(unit: &str) -> Option<String> {
    super::units::Exponents::parse(unit)?;
    Some(unit.replace('²', "2").replace('³', "3").replace(['Ω'], "Ohm").replace("ohm", "Ohm").replace(' ', "."))
}

#[cfg(test)]
mod tests {
    use greyrig::motor::{Motor, OperatingPoint, Parameters, State};

    use super::*;
    use crate::term::Formula;

    /// Reads formulas as Modelica does, and knows nothing of effects.
    struct Reader<'a> {
        rest: &'a str,
        names: &'a [(String, f64)],
    }

    impl Reader<'_> {
        fn takes(&mut self, what: &str) -> bool {
            self.rest = self.rest.trim_start();
            let rest = self.rest.strip_prefix(what);
            self.rest = rest.unwrap_or(self.rest);
            rest.is_some()
        }

        fn sum(&mut self) -> f64 {
            let mut sum = if self.takes("-") { -self.product() } else { self.product() };
            loop {
                if self.takes("+") {
                    sum += self.product();
                } else if self.takes("-") {
                    sum -= self.product();
                } else {
                    return sum;
                }
            }
        }

        fn product(&mut self) -> f64 {
            let mut product = self.power();
            loop {
                if self.takes("*") {
                    product *= self.power();
                } else if self.takes("/") {
                    product /= self.power();
                } else {
                    return product;
                }
            }
        }

        fn power(&mut self) -> f64 {
            let base = self.primary();
            if self.takes("^") { base.powf(self.primary()) } else { base }
        }

        fn primary(&mut self) -> f64 {
            if self.takes("(") {
                let inner = self.sum();
                assert!(self.takes(")"), "{}", self.rest);
                return inner;
            }
            let part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
            let (word, rest) = self.rest.split_at(self.rest.find(|c| !part(c)).unwrap_or(self.rest.len()));
            self.rest = rest;
            if let Ok(number) = word.parse() {
                return number;
            }
            if let Some((_, value)) = self.names.iter().find(|(name, _)| name == word) {
                return *value;
            }
            let x = self.primary();
            match word {
                "abs" => x.abs(),
                "sign" => {
                    if x == 0.0 {
                        0.0
                    } else {
                        x.signum()
                    }
                }
                "sqrt" => x.sqrt(),
                "exp" => x.exp(),
                "log" => x.ln(),
                "tanh" => x.tanh(),
                _ => panic!("{word} is no name and no function of Modelica"),
            }
        }
    }

    fn value(formula: &str, [i, omega, u]: [f64; 3], names: &[(String, f64)]) -> f64 {
        let signals = [("i", i), ("omega", omega), ("u", u)].map(|(name, value)| (name.to_owned(), value));
        let names: Vec<_> = signals.into_iter().chain(names.iter().cloned()).collect();
        let mut reader = Reader { rest: formula, names: &names };
        let value = reader.sum();
        assert!(reader.rest.trim().is_empty(), "{formula}: {}", reader.rest);
        value
    }

    /// Each formula against the core's balance and what its measuring chain shows, over both signs of all signals.
    #[test]
    fn formulas_are_the_laws_of_the_core() {
        let base = [2.2, 0.02, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8];
        let parameters = Parameters::from_values(FluxLaw::Series, base);
        let mut formulated = 0;
        for id in EffectId::ALL.iter().copied() {
            let mut f = Formulas::base();
            if f.with(id).is_none() {
                continue;
            }
            formulated += 1;
            let description = id.description();
            // Inside each range, and different from each other: a formula that takes one for the other is told.
            let values: Vec<f64> = description
                .parameters
                .iter()
                .enumerate()
                .map(|(n, p)| (0.3 + 0.17 * n as f64).clamp(p.range.0.max(1e-6), p.range.1))
                .collect();
            let motor = Motor::build(parameters, &[Effect::new(id, &values)]).expect("a motor");
            let effects = description.parameters.iter().map(|p| p.name.to_owned()).zip(values.iter().copied());
            let bases = BaseParameter::ALL.iter().map(|p| p.name().to_owned()).zip(base);
            let names: Vec<(String, f64)> = effects.chain(bases).collect();
            for point @ [current, speed, voltage] in
                [[3.1, 40.0, 12.0], [-2.3, 17.0, -9.0], [0.7, -25.0, 0.2], [-0.4, -3.0, 100.0]]
            {
                let state = State { current, speed };
                let memories = motor.memories_at_start(state);
                let b = motor.balance(&OperatingPoint { current, speed, voltage }, &memories);
                let shown = motor.measure(&memories, state);
                for (what, formula, own) in [
                    ("magnetising", &f.magnetising, b.magnetising),
                    ("flux", &f.flux, b.flux),
                    ("supply", &f.supply, b.supply),
                    ("resistance", &f.resistance, b.resistance),
                    ("inductance", &f.inductance, b.inductance),
                    ("voltage", &f.voltage, b.voltage),
                    ("torque", &f.torque, b.torque),
                    ("dry friction", &f.dry_friction, b.dry_friction),
                    ("viscous friction", &f.viscous_friction, b.viscous_friction),
                    ("turbulent friction", &f.turbulent_friction, b.turbulent_friction),
                    ("friction", &f.friction, b.friction),
                    ("current", &f.shown_current, shown.current),
                    ("speed", &f.shown_speed, shown.speed),
                ] {
                    let by_formula = value(formula, point, &names);
                    assert!(
                        (by_formula - own).abs() <= 1e-9 * own.abs().max(1e-9),
                        "{id}, {what} at {point:?}: {formula} is {by_formula}, not {own}"
                    );
                }
            }
        }
        assert!(formulated >= 20, "{formulated}");
    }

    /// Of a term's operations the same formula comes again, as the parser of terms reads it.
    #[test]
    fn a_term_is_written_as_it_is_computed() {
        for text in ["k*i*abs(i)", "torque: a*tanh(w/b) - c*w^3/(1 + sqrt(abs(u)))", "-i^2 + 2^-1*exp(-w)"] {
            let formula = Formula::parse(text).unwrap();
            let unknowns = [0.7, 0.3, 0.11];
            let term = formula.term::<f32>(&unknowns);
            let names: Vec<String> = formula.unknowns().iter().map(|name| unknown(0, name)).collect();
            let valued: Vec<(String, f64)> = names.iter().cloned().zip(unknowns).collect();
            let point = [1.3, 2.5, -4.0];
            let expected = formula.term::<f64>(&unknowns).value(point[0], point[1], point[2]);
            let found = value(&infix(&term, &names), point, &valued);
            assert!((found - expected).abs() < 1e-6 * expected.abs(), "{text}: {found}, not {expected}");
        }
    }
}
