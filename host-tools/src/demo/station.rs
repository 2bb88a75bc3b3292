//! The end of the line: limits from healthy motors of the type, and motors judged by them.

use serde_json::{Value, json};

use crate::context::Context;
use crate::error::Result;
use crate::model::{Kind, Model};
use crate::monitor::calibrate::{self, calibrate};
use crate::monitor::test::{self, Test};
use crate::recording::Recording;
use crate::rig::{Motor, Setup};

/// Begin of a test that is not judged, which has a soft start, s.
const RUN_UP_S: f64 = 3.0;
const TEST_S: f64 = 7.0;
/// Relative scatter of the motors' parameters.
const SCATTER: f64 = 0.03;
/// Healthy motors that the limits are from: their numbers.
const HEALTHY: std::ops::RangeInclusive<u64> = 1..=10;
/// The number of the motors that are judged.
const JUDGED: u64 = 99;
const SPARKING: &str = "sparking=0.2@5";

/// What a station has measured.
pub struct Station {
    /// Three motors: what they have, and how they were judged.
    pub tests: Vec<(&'static str, Test)>,
    /// The motor that the model is of, healthy and with brushes that spark from 5 s on: the paper's case, in which no
    /// scatter of the lot hides the residual.
    pub of_the_type: [Test; 2],
}

impl Station {
    /// Takes limits from healthy motors that hide the same, and judges others.
    ///
    /// # Errors
    /// An interrupt.
    pub fn run(model: &Model, hidden: &[&str], ctx: &Context) -> Result<Self> {
        let recorded = |motor: Motor, seed: u64, fault: Option<&str>| -> Result<Recording> {
            let mut setup = Setup::new(Kind::Universal).profile("steady")?.seconds(TEST_S).seed(seed).motor(motor);
            setup = hidden.iter().try_fold(setup, |setup, effect| setup.effect(effect))?;
            if let Some(fault) = fault {
                setup = setup.fault(fault)?;
            }
            Ok(setup.run_in(ctx)?.recording)
        };
        let of_the_lot = |seed: u64, fault: Option<&str>| {
            recorded(Motor::sample_from_population(&Motor::universal(), SCATTER, seed), seed, fault)
        };
        let healthy: Vec<Recording> = HEALTHY.map(|seed| of_the_lot(seed, None)).collect::<Result<_>>()?;
        let detector = calibrate(model, &healthy, calibrate::Settings::blanking(RUN_UP_S), ctx)?.detector;
        let judged = |recording: Recording| test::test(model, &detector, &recording, ctx);
        let tests = [
            ("healthy", None),
            ("sparking brushes from 5 s on", Some(SPARKING)),
            ("bearing friction doubled from 5 s on", Some("bearing_friction=1@5")),
        ];
        let tests = tests.map(|(label, fault)| Ok((label, judged(of_the_lot(JUDGED, fault)?)?)));
        let of_the_type = |fault| judged(recorded(Motor::universal(), JUDGED, fault)?);
        Ok(Self {
            tests: tests.into_iter().collect::<Result<_>>()?,
            of_the_type: [of_the_type(None)?, of_the_type(Some(SPARKING))?],
        })
    }

    /// For a program.
    pub fn in_json(&self) -> Vec<Value> {
        self.tests.iter().map(|(label, test)| json!({ "motor": label, "test": test })).collect()
    }
}
