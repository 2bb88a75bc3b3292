//! A production lot at the station: healthy motors that must pass, and faults from slight to gross that must not.
//!
//! Ten motors teach the limits; others, which nobody has seen, are judged. The type's model is identified on one motor,
//! in three stages: physics alone, with the learned correction, and with the physical effects added before the
//! correction.

use greyrig::detector::{Features, Verdict};
use greyrig::effects::EffectId;
use greyrig_host::anfis::Method;
use greyrig_host::context::Context;
use greyrig_host::error::Result;
use greyrig_host::hybrid;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::{DetectorEntry, Kind, Model};
use greyrig_host::monitor::calibrate::{self, calibrate, shown};
use greyrig_host::monitor::replay::replay;
use greyrig_host::monitor::test::{Test, test};
use greyrig_host::recording::Recording;
use greyrig_host::rig::{Motor, Setup};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What all motors of the type have beside their saturation.
const EFFECTS: [&str; 2] = ["hysteresis=0.1", "brush_arcing=0.02"];
/// Recordings that teach the type's model, as many of them as are asked for: length, s, number, and peak voltage, V, if
/// it is not the nominal one.
const STAIRCASES: [(f64, u64, Option<f64>); 5] =
    [(12.0, 1, None), (12.0, 11, Some(300.0)), (7.0, 12, None), (9.0, 13, Some(280.0)), (10.0, 14, Some(312.0))];
/// Relative scatter of the parameters.
pub const SPREAD: f64 = 0.03;
/// Motors that teach the limits.
pub const TEACHERS: u64 = 10;
/// Length of a test, s.
pub const TEST_S: f64 = 7.0;
/// Begin that is not judged, s: the motor runs up.
const BLANKING_S: f64 = 3.0;
/// Faults begin at a random time between these, s.
const ONSET_S: (f64, f64) = (4.2, 5.2);

/// A fault with its sizes from slight to gross, and where it sits.
pub struct Fault {
    /// Identifier.
    pub id: &'static str,
    /// Where it sits.
    pub kind: &'static str,
    /// Sizes.
    pub sizes: &'static [f64],
}

/// The faults that are asked for.
pub const FAULTS: &[Fault] = &[
    Fault { id: "resistance_up", kind: "electrical", sizes: &[0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8] },
    Fault { id: "sparking", kind: "electrical", sizes: &[0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.4] },
    Fault { id: "bearing_friction", kind: "mechanical", sizes: &[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0] },
    Fault { id: "fan_load", kind: "mechanical", sizes: &[-0.01, -0.02, -0.05, -0.1, -0.2, -0.4, -0.6] },
    Fault { id: "current_sensor", kind: "sensor", sizes: &[0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3] },
    Fault { id: "speed_sensor", kind: "sensor", sizes: &[-0.002, -0.005, -0.01, -0.02, -0.05, -0.1, -0.3] },
];

/// A model of the type with the station's limits.
pub struct Station {
    /// What it is.
    pub name: &'static str,
    /// The type's model.
    pub model: Model,
    detector: DetectorEntry,
}

/// When a fault begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Onset {
    /// At a random time of the test.
    During,
    /// Before the test.
    Before,
}

/// A motor type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorType {
    /// Part of the flux that saturation takes.
    pub saturation: f64,
    /// Staircases that teach its model, five at most.
    pub staircases: usize,
}

impl MotorType {
    /// The virtual rig with what all motors of the type have.
    ///
    /// # Errors
    /// An unknown profile, an impossible saturation.
    pub fn rig(&self, profile: &str, seconds: f64, seed: u64) -> Result<Setup> {
        let setup = Setup::new(Kind::Universal).profile(profile)?.seconds(seconds).seed(seed);
        let saturated = setup.effect(&format!("saturation={}", self.saturation))?;
        EFFECTS.into_iter().try_fold(saturated, |setup, effect| setup.effect(effect))
    }

    /// The test of a motor of the lot, perhaps with a fault, and when that begins, s.
    ///
    /// # Errors
    /// An interrupt.
    pub fn motor(&self, seed: u64, fault: Option<(&str, f64)>, onset: Onset) -> Result<(Recording, f64)> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let onset = match onset {
            Onset::During => ONSET_S.0 + random.random::<f64>() * (ONSET_S.1 - ONSET_S.0),
            Onset::Before => 0.0,
        };
        let mut setup =
            self.rig("steady", TEST_S, seed)?.motor(Motor::sample_from_population(&Motor::universal(), SPREAD, seed));
        if let Some((id, size)) = fault {
            setup = setup.fault(&format!("{id}={size}@{onset}"))?;
        }
        Ok((setup.run()?.recording, onset))
    }

    /// The motor that the type's model was identified on, perhaps with a fault that is there from the start: the
    /// paper's case.
    ///
    /// # Errors
    /// An interrupt.
    pub fn type_motor(&self, fault: Option<(&str, f64)>) -> Result<Recording> {
        let setup = self.rig("steady", TEST_S, 5)?;
        let setup = match fault {
            Some((id, size)) => setup.fault(&format!("{id}={size}@0"))?,
            None => setup,
        };
        Ok(setup.run()?.recording)
    }

    /// The three stations.
    ///
    /// # Errors
    /// An interrupt.
    pub fn stations(&self) -> Result<Vec<Station>> {
        let staircase = |(seconds, seed, peak_voltage_v): (f64, u64, Option<f64>)| {
            Ok(Setup { peak_voltage_v, ..self.rig("staircase", seconds, seed)? }.run()?.recording)
        };
        let training: Vec<Recording> =
            STAIRCASES.into_iter().take(self.staircases).map(staircase).collect::<Result<_>>()?;
        let teachers: Vec<Recording> = (1..=TEACHERS)
            .map(|seed| Ok(self.motor(1_000_000 + seed, None, Onset::During)?.0))
            .collect::<Result<_>>()?;
        let named = |effects: &[EffectId]| Settings { effects: effects.to_vec(), ..Settings::new(Kind::Universal) };
        let bare = identify(&training, &named(&[]), &Context::quiet())?.model;
        let physics =
            identify(&training, &named(&[EffectId::Saturation, EffectId::Hysteresis]), &Context::quiet())?.model;
        let corrected = |model: &Model| -> Result<Model> {
            let settings = hybrid::settings(Method::Varpro, 60);
            Ok(hybrid::train(model, &training, 1.0, &settings, &Context::quiet())?.0)
        };
        let stages = [
            ("physical model alone", bare.clone()),
            ("with the learned correction", corrected(&bare)?),
            ("with effects and correction", corrected(&physics)?),
        ];
        stages
            .into_iter()
            .map(|(name, model)| {
                let detector =
                    calibrate(&model, &teachers, calibrate::Settings::blanking(BLANKING_S), &Context::quiet())?
                        .detector;
                Ok(Station { name, model, detector })
            })
            .collect()
    }
}

/// What a station makes of a run, without looking for the cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glance {
    /// Largest of all watched values over its limit: what a receiver operating characteristic sweeps.
    pub score: f64,
    /// The detector's verdict.
    pub verdict: Verdict,
    /// First alarm, s.
    pub alarm_s: Option<f64>,
    /// Means over the judged periods.
    pub features: Features,
}

impl Glance {
    /// Mean error of current and speed.
    pub fn errors(&self) -> [f64; 2] {
        [self.features.current, self.features.speed].map(f64::from)
    }
}

impl Station {
    /// Tests a motor.
    ///
    /// # Errors
    /// An interrupt.
    pub fn test(&self, recording: &Recording) -> Result<Test> {
        test(&self.model, &self.detector, recording, &Context::quiet())
    }

    /// Looks at a run as the microcontroller does.
    ///
    /// # Errors
    /// An interrupt.
    pub fn glance(&self, recording: &Recording) -> Result<Glance> {
        let detector = &self.detector;
        let run = replay(&self.model, recording, &|interval| detector.settings(interval), &Context::quiet())?;
        let score = shown(&run).map_or(0.0, |s| {
            let over = [
                (s.current, detector.current),
                (s.speed, detector.speed),
                (s.sparking, detector.sparking),
                (s.current_jump, detector.current_jump),
                (s.speed_jump, detector.speed_jump),
            ];
            let beyond =
                [(s.current_deviation, detector.current_deviation), (s.speed_deviation, detector.speed_deviation)];
            let ratios = over.into_iter().map(|(value, limit)| value / limit);
            let deviations =
                beyond.into_iter().flat_map(|(ends, [centre, half])| ends.map(|d| (d - centre).abs() / half));
            ratios.chain(deviations).fold(0.0, f64::max)
        });
        let alarm_s = run.rows.iter().find(|r| r.alarm.is_some()).map(|r| r.t_s);
        let features = Features::mean(run.judged().map(|r| &r.features));
        Ok(Glance { score, verdict: run.verdict, alarm_s, features })
    }
}
