//! Ways to a model, one after the other, each judged on data that it has not seen.

use greyrig::effects::EffectId;
use serde_json::{Value, json};

use crate::compare::{Comparison, PerSignal, compare};
use crate::context::Context;
use crate::error::Result;
use crate::identify::{self, Identification, Method, Settings};
use crate::model::{Kind, Model, Origin};
use crate::recording::Recording;
use crate::report::Step;
use crate::rig::Setup;

/// The recordings of a motor.
pub struct Data {
    /// What models are fitted to.
    pub training: Vec<Recording>,
    /// What they are judged on.
    pub held_out: Vec<Recording>,
}

impl Data {
    /// Of a motor that hides something.
    ///
    /// # Errors
    /// An effect that the rig does not have; an interrupt.
    pub fn of(hidden: &[&str], seed: u64, ctx: &Context) -> Result<Self> {
        let record = |profile: &str, name: &str, seed: u64| -> Result<Vec<Recording>> {
            let setup = Setup::new(Kind::Universal).profile(profile)?.seed(seed);
            let setup = hidden.iter().try_fold(setup, |setup, effect| setup.effect(effect))?;
            Ok(vec![setup.run_in(ctx)?.recording.named(name)])
        };
        Ok(Self {
            training: record("staircase", "staircase.csv", seed)?,
            held_out: record("ramp", "ramp.csv", seed + 1)?,
        })
    }

    /// Where they are from.
    pub fn origins(&self) -> Vec<Origin> {
        self.training.iter().chain(&self.held_out).map(Origin::from).collect()
    }
}

/// One way to a model.
pub struct Attempt {
    /// What is new in it.
    pub label: String,
    /// The model, and how sure it is.
    pub identification: Identification,
    /// The model on data held out.
    pub held_out: Comparison,
}

impl Attempt {
    fn new(label: &str, method: Method, effects: &[EffectId], data: &Data, ctx: &Context) -> Result<Self> {
        let settings = Settings { method, effects: effects.to_vec(), ..Settings::new(Kind::Universal) };
        let identification = identify::identify(&data.training, &settings, ctx)?;
        let held_out = compare(&identification.model, &data.held_out, ctx)?;
        Ok(Self { label: label.to_owned(), identification, held_out })
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.identification.model
    }
}

/// The physical model by two methods, and with one effect more each time.
pub struct Attempts {
    least_squares: Attempt,
    output_error: Attempt,
    with_effects: Vec<Attempt>,
}

impl Attempts {
    /// The physical model by itself.
    ///
    /// # Errors
    /// An interrupt.
    pub fn without_effects(data: &Data, ctx: &Context) -> Result<Self> {
        Ok(Self {
            least_squares: Attempt::new("least squares", Method::LeastSquares, &[], data, ctx)?,
            output_error: Attempt::new("output error", Method::OutputError, &[], data, ctx)?,
            with_effects: Vec::new(),
        })
    }

    /// Adds effects, one after the other.
    ///
    /// # Errors
    /// An interrupt.
    pub fn add_each(&mut self, effects: &[EffectId], data: &Data, ctx: &Context) -> Result<()> {
        for (k, id) in effects.iter().enumerate() {
            let label = format!("+ {id}");
            self.with_effects.push(Attempt::new(&label, Method::OutputError, &effects[..=k], data, ctx)?);
        }
        Ok(())
    }

    /// The physical model by the paper's method.
    pub fn least_squares(&self) -> &Attempt {
        &self.least_squares
    }

    /// The physical model at its best.
    pub fn physical(&self) -> &Attempt {
        &self.output_error
    }

    /// With all effects.
    pub fn improved(&self) -> &Attempt {
        self.with_effects.last().unwrap_or(&self.output_error)
    }

    /// All of them, from the first to the last.
    pub fn iter(&self) -> impl Iterator<Item = &Attempt> {
        [&self.least_squares, &self.output_error].into_iter().chain(&self.with_effects)
    }

    /// The end of the road.
    pub fn noise_floor(&self) -> PerSignal {
        self.improved().held_out.noise_floor
    }

    /// Errors on data held out, for a figure.
    pub fn steps(&self) -> Vec<Step> {
        self.iter().map(|a| Step { label: a.label.clone(), esr: a.held_out.esr }).collect()
    }

    /// For a program.
    pub fn in_json(&self) -> Vec<Value> {
        let of = |a: &Attempt| json!({ "method": a.label, "parameters": a.identification.parameters, "held_out": a.held_out.esr });
        self.iter().map(of).collect()
    }
}
