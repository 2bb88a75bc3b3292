//! What is counted in instructions.

use core::hint::black_box;

use greyrig::anfis::{Firing, Shape};
use greyrig::app::bench::MOTOR;
use greyrig::app::{Sampler, Shared, Station};
use greyrig::butterworth::{Cascade, Settings, fixed};
use greyrig::effects::Effect;
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::motor::{Constraints, State};
use greyrig::parameters::Active;
use greyrig::sequence::Wishes;
use greyrig::tick::Output;
use greyrig::units::{Amperes, CalibrationSettings, Counts, RadiansPerSecond, Sample, Volts};

use crate::scenarios;

/// Runs of what takes the same every time.
const RUNS: usize = 16;

/// What the converter shows in the middle of a half-wave.
const COUNTS: Counts = Counts { voltage: 3_225, current: 2_380, speed: 2_785 };

/// Samples within which the detector comes to the end of a period and judges it.
const PERIODS: usize = 2_000;

/// Reversals of the rotor, and samples within which each is over.
pub const REVERSALS: u16 = 60;
/// See [`REVERSALS`].
pub const REVERSAL: u16 = 600;

/// A rotor that turns backwards at first, so fast that it is turned round at another sample each time.
pub struct Reversals {
    /// What the converter shows of a sample.
    pub counts: fn(u16) -> Counts,
    /// Samples of a report.
    pub report: u32,
    /// The least speed backwards, rad/s, and what is added to it each time.
    pub speed: [f32; 2],
}

impl Reversals {
    /// On alternating voltage.
    pub const ALTERNATING: Self = Self { counts: scenarios::counts, report: 7, speed: [20.0, 12.0] };
    /// While the first period is judged, with a report on every sample.
    pub const JUDGED: Self = Self { counts: scenarios::direct_counts, report: 1, speed: [188.0, 1.0] };

    /// The interrupt with all that a station has, before the rotor is turned round for the n-th time.
    pub fn sampler<'a>(&self, shared: &'a Shared, b: Option<f64>, n: u16) -> Option<Sampler<'a>> {
        let [slowest, faster] = self.speed;
        scenarios::full_sampler(shared, b, -slowest - faster * f32::from(n))
    }
}

/// Counts instructions, or on the host merely runs what would be counted.
pub trait Counter {
    /// Counts `run`, which works on `state`; it is run several times in a row. Names have no spaces.
    fn count<S>(&mut self, name: &str, state: S, run: impl FnMut(&mut S)) {
        self.count_runs(name, RUNS, state, |_| (), run);
    }
    /// The same for a number of runs, of which the longest counts; what makes ready for one is not counted.
    fn count_runs<S>(&mut self, name: &str, runs: usize, state: S, ready: impl FnMut(&mut S), run: impl FnMut(&mut S));
}

/// Everything that is counted: a line each.
pub fn all(counter: &mut impl Counter) {
    for (name, order) in
        [("butterworth_f32_order_2", 2), ("butterworth_f32_order_4", 4), ("butterworth_f32_order_8", 8)]
    {
        let settings = Settings { order, ..Settings::default() };
        let Ok(coefficients) = settings.build::<f32>() else { return };
        counter.count(name, (coefficients, Cascade::default()), |(coefficients, cascade)| {
            black_box(cascade.process(coefficients, black_box(0.7)));
        });
    }
    let Ok(coefficients) = Settings::default().build_fixed() else { return };
    counter.count("butterworth_fixed_order_4", (coefficients, fixed::Cascade::default()), |(coefficients, cascade)| {
        black_box(cascade.process(coefficients, black_box(123_456_789)));
    });
    let Ok(coefficients) = Settings::default().build::<f64>() else { return };
    counter.count("butterworth_f64_order_4", (coefficients, Cascade::default()), |(coefficients, cascade)| {
        black_box(cascade.process(coefficients, black_box(0.7)));
    });
    let Some(tick) = scenarios::tick() else { return };
    counter.count("tick", tick, |tick| {
        let sample =
            black_box(Sample { voltage: Volts(230.0), current: Amperes(6.5), speed: RadiansPerSecond(3_400.0) });
        black_box(tick.process(sample, Constraints::FREE));
    });
    let (Some(tick), Ok(calibration)) = (scenarios::tick(), CalibrationSettings::default().build()) else { return };
    let shared = scenarios::busy_shared();
    let sampler = Sampler::new(Some(Active { calibration, tick, detector: None }), &shared, &NUCLEO_G474RE);
    counter.count("interrupt", sampler, |sampler| interrupt(sampler, COUNTS));
    for (name, b) in [("interrupt_full_bell_free", None), ("interrupt_full_bell_2", Some(2.0))] {
        let Some(sampler) = scenarios::full_sampler(&shared, b, 0.0) else { return };
        counter.count(name, sampler, |sampler| interrupt(sampler, COUNTS));
    }
    for (name, b) in [("interrupt_full_periods_bell_free", None), ("interrupt_full_periods_bell_2", Some(2.0))] {
        let shared = scenarios::busy_shared();
        let Some(sampler) = scenarios::full_sampler(&shared, b, 0.0) else { return };
        let next = |(_, n, counts): &mut (Sampler, u16, Counts)| {
            scenarios::drain(&shared);
            *n += 1;
            *counts = scenarios::counts(*n);
        };
        counter.count_runs(name, PERIODS, (sampler, 0, COUNTS), next, |(sampler, _, counts)| {
            interrupt(sampler, *counts);
        });
    }
    for (name, b, reversals) in [
        ("interrupt_full_reversing_bell_free", None, Reversals::ALTERNATING),
        ("interrupt_full_reversing_bell_2", Some(2.0), Reversals::ALTERNATING),
        ("interrupt_full_reversing_judged_bell_free", None, Reversals::JUDGED),
        ("interrupt_full_reversing_judged_bell_2", Some(2.0), Reversals::JUDGED),
    ] {
        let shared = scenarios::busy_shared();
        shared.report(reversals.report);
        let Some(sampler) = reversals.sampler(&shared, b, 0) else { return };
        let next = |(sampler, n, counts): &mut (_, u16, Counts)| {
            scenarios::drain(&shared);
            if *n % REVERSAL == 0
                && let Some(backwards) = reversals.sampler(&shared, b, *n / REVERSAL)
            {
                *sampler = backwards;
            }
            *counts = (reversals.counts)(*n % REVERSAL + 1);
            *n += 1;
        };
        let runs = usize::from(REVERSALS * REVERSAL);
        counter.count_runs(name, runs, (sampler, 0, COUNTS), next, |(sampler, _, counts)| {
            interrupt(sampler, *counts);
        });
    }
    station(counter);
    let motors: [(&str, &[Effect<f32>]); 2] = [("motor_step", &[]), ("motor_step_effects", &scenarios::EFFECTS)];
    for (name, effects) in motors {
        let Some(stepper) = scenarios::stepper(MOTOR, effects) else { return };
        counter.count(name, stepper, |stepper| {
            black_box(stepper.step(black_box(200.0), black_box(230.0), Constraints::FREE));
        });
    }
    for (name, shape, b) in scenarios::ANFIS {
        let Some(network) = scenarios::anfis(shape, b, Firing::Product) else { return };
        counter.count(name, network, |network| {
            black_box(network.correct(black_box([120.0, 3.0, 2_000.0])));
        });
    }
    for (name, point) in [
        ("anfis_inside", [120.0, 3.0, 2_000.0]),
        ("anfis_in_the_margin", [340.0, 9.2, 1.0]),
        ("anfis_far_outside", [1e30, -1e30, 0.0]),
        ("anfis_nan", [f32::NAN, f32::INFINITY, f32::NAN]),
    ] {
        let Some(network) = scenarios::anfis(Shape::Bell, None, Firing::Product) else { return };
        counter.count(name, network, |network| {
            black_box(network.correct(black_box(point)));
        });
    }
    let Some(network) = scenarios::anfis(Shape::Bell, None, Firing::Minimum) else { return };
    counter.count("anfis_minimum", network, |network| {
        black_box(network.correct(black_box([120.0, 3.0, 2_000.0])));
    });
    counter.count("exp_f32", (), |()| {
        black_box(greyrig::scalar::Scalar::exp(black_box(-1.3_f32)));
    });
}

/// Samples of the station that are counted: contacts that close, a run to its verdict, another one that is stopped.
const STATION: u16 = 6_000;

/// The station's sequence in every state; nobody waits, so that each sample is what it is on a board.
fn station(counter: &mut impl Counter) {
    let Some(sequence) = scenarios::sequence() else { return };
    let shared = scenarios::busy_shared();
    let station = Station::new(Some(sequence), scenarios::Gear::default(), &shared);
    let next = |(station, n, output): &mut (Station<scenarios::Gear>, u16, Option<Output>)| {
        let wish = |wishes| shared.wish(wishes);
        match *n {
            400 | 5_000 => wish(Wishes { acknowledge: true, ..Wishes::default() }),
            // A run of 1,000 samples and 500 for its verdict, one that is aborted, one that trips.
            401 | 3_000 | 5_001 => wish(Wishes { start: true, ..Wishes::default() }),
            _ => {}
        }
        let contacts = &mut station.switchgear().contacts;
        contacts.abort_closed = !(3_300..4_000).contains(n);
        contacts.emergency_closed = *n % 50 != 7;
        station.switchgear().tripped = *n > 5_500;
        let speed = if (401..1_500).contains(n) || *n >= 3_000 { 1_000.0 } else { 1.0 };
        *output = Some(Output { measured: State { current: 1.0, speed }, ..Output::default() });
        *n += 1;
    };
    counter.count_runs("station", STATION.into(), (station, 0, None), next, |(station, _, output)| {
        station.sample(black_box(output), 0);
    });
}

/// What a board's interrupt does once it has the counts, called from one place in the program as there.
#[inline(never)]
fn interrupt(sampler: &mut Sampler, counts: Counts) {
    sampler.sample(black_box(counts), 0);
}
