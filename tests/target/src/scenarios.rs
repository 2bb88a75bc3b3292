//! What has to come out the same on the host and on the microcontroller.

use greyrig::anfis::{self, Anfis3x3, Firing, Premise, Settings3x3, Shape};
use greyrig::app::bench::{Bench, MOTOR};
use greyrig::app::{Sampler, Shared, Switchgear};
use greyrig::butterworth::{self, Settings, fixed};
use greyrig::detector::{self, Verdict};
use greyrig::effects::{
    BrushDrop, ChannelDelay, CurrentCompression, Description, EddyCurrent, Effect, Hysteresis, MAX_EFFECT_PARAMETERS,
    Saturation, SpeedLag, TorqueOffset, WindingTemperature,
};
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::motor::{Constraints, FluxLaw, Motor, Parameters, State, Stepper};
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::{Active, FINGERPRINT, Settings as Parameterised, section};
use greyrig::scalar::Scalar;
use greyrig::sequence::{self, Contacts, Seen, Segment, Sequence, Stuck, Supplied, Supply, Wave, Wishes};
use greyrig::term::{Op, Target, Term};
use greyrig::tick::{Output, Tick};
use greyrig::units::{Amperes, CalibrationSettings, Counts, RadiansPerSecond, Sample, Volts};

use crate::Outputs;

/// A name without spaces, and what computes the outputs.
pub type Scenario = (&'static str, fn(&mut Outputs));

/// All scenarios.
pub const ALL: &[Scenario] = &[
    ("butterworth_design", butterworth_design),
    ("butterworth_f32", butterworth_f32),
    ("butterworth_f64", butterworth_f64),
    ("butterworth_fixed", butterworth_fixed),
    ("butterworth_bad_samples", butterworth_bad_samples),
    ("scalar_functions", scalar_functions),
    ("motor_universal", motor_universal),
    ("motor_magnet", motor_magnet),
    ("motor_effects", motor_effects),
    ("motor_chain", motor_chain),
    ("motor_each_effect", motor_each_effect),
    ("tick_any_counts", tick_any_counts),
    ("tick_bad_samples", tick_bad_samples),
    ("parameter_block", parameter_block),
    ("damaged_blocks", damaged_blocks),
    ("tick_from_block", tick_from_block),
    ("commands", commands),
    ("anfis_inside", anfis_inside),
    ("anfis_any_bits", anfis_any_bits),
    ("anfis_minimum", anfis_minimum),
    ("anfis_f64", anfis_f64),
    ("anfis_other_grids", anfis_other_grids),
];

/// Samples for each setting.
const SAMPLES: usize = 250;

/// Pseudo-random numbers: xorshift with the shifts 13, 17, 5 (Marsaglia 2003, "Xorshift RNGs").
struct Noise(u32);

impl Noise {
    fn bits(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// Within ±1, in steps of 2^-23, so that it is exact in both precisions.
    fn uniform<S: Scalar>(&mut self) -> S {
        S::constant(f64::from(self.bits() >> 8) / f64::from(1 << 23) - 1.0)
    }
}

/// Every order at a low, the usual and a high cut-off.
fn settings() -> impl Iterator<Item = Settings> {
    (1..=8).flat_map(|order| {
        [1.0, 10.0, 250.0, 3_900.0].map(|cutoff_hz| Settings { order, cutoff_hz, sample_rate_hz: 10_000.0 })
    })
}

fn butterworth_design(outputs: &mut Outputs) {
    for settings in settings() {
        for section in settings.second_order_sections().iter().flatten() {
            section.iter().for_each(|&coefficient| outputs.f64(coefficient));
        }
    }
    outputs.f64(Settings::default().settling_samples().map_or(f64::NAN, f64::from));
}

fn floating<S: Scalar>(mut sample: impl FnMut() -> S, mut output: impl FnMut(S)) {
    for coefficients in settings().flat_map(|settings| settings.build::<S>()) {
        let mut cascade = butterworth::Cascade::default();
        for _ in 0..SAMPLES {
            output(cascade.process(&coefficients, sample()));
        }
    }
}

fn butterworth_f32(outputs: &mut Outputs) {
    let mut noise = Noise(1);
    floating::<f32>(|| noise.uniform(), |y| outputs.f32(y));
}

fn butterworth_f64(outputs: &mut Outputs) {
    let mut noise = Noise(2);
    floating::<f64>(|| noise.uniform(), |y| outputs.f64(y));
}

/// Any 32 bits are a sample: NaNs, infinities, subnormals and magnitudes beyond the limit are all among them.
fn butterworth_bad_samples(outputs: &mut Outputs) {
    const SPECIAL: [f32; 8] =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e30, 1e-40, f32::MIN_POSITIVE, -0.0];
    let mut noise = Noise(3);
    let sample = || match noise.bits() % 16 {
        special @ 0..8 => SPECIAL[special as usize],
        8..12 => f32::from_bits(noise.bits()),
        _ => noise.uniform(),
    };
    floating::<f32>(sample, |y| outputs.f32(y));
}

/// Full range, hence overload most of the time.
fn butterworth_fixed(outputs: &mut Outputs) {
    let mut noise = Noise(4);
    for coefficients in settings().flat_map(|settings| settings.build_fixed()) {
        let mut cascade = fixed::Cascade::default();
        for n in 0..SAMPLES {
            let sample = match n % 64 {
                0 => i32::MIN,
                1 => i32::MAX,
                _ => noise.bits().cast_signed(),
            };
            outputs.i32(cascade.process(&coefficients, sample));
        }
    }
}

/// The functions under all models, for any bits as their argument.
fn scalar_functions(outputs: &mut Outputs) {
    let mut noise = Noise(5);
    for n in 0..2_000 {
        let x = if n % 2 == 0 { f32::from_bits(noise.bits()) } else { 8.0 * noise.uniform::<f32>() };
        for y in [Scalar::sqrt(x), Scalar::exp(x), Scalar::ln(x), Scalar::tanh(x), Scalar::atan(x)] {
            outputs.f32(y);
        }
        for y in [Scalar::sin(x), Scalar::cos(x), Scalar::round(x)] {
            outputs.f32(y);
        }
    }
}

/// A small motor with magnets, so stiff that it is stepped four times a sample.
const MAGNET: Parameters<f32> = Parameters {
    flux_law: FluxLaw::PermanentMagnet,
    resistance: 2.35,
    inductance: 1e-4,
    flux_coefficient: 0.0226,
    inertia: 1.1e-6,
    dry_friction: 1.2e-3,
    viscous_friction: 1e-7,
    turbulent_friction: 0.0,
};

/// A constant torque, so that a loop over effects has something to do.
const OFFSET: [Effect<f32>; 1] = [Effect::TorqueOffset(TorqueOffset { torque: 1e-4 })];

/// A motor whose iron, brushes and winding are far from ideal.
pub const EFFECTS: [Effect<f32>; 5] = [
    Effect::Hysteresis(Hysteresis { coercive: 0.14, resting: 0.9, closing: 0.5, linked: 0.6 }),
    Effect::Saturation(Saturation { depth: 0.8, knee: 7.4, softness: 1.5, linked: 0.6 }),
    Effect::EddyCurrent(EddyCurrent { lag: 8e-5, linked: 0.6 }),
    Effect::WindingTemperature(WindingTemperature { heating: 1.7e-4, time: 40.0 }),
    Effect::BrushDrop(BrushDrop { drop: 2.6, transition: 0.28 }),
];

/// A measuring chain that is late, slow and bent; the delay is no whole number of steps.
const CHAIN: [Effect<f32>; 3] = [
    Effect::CurrentCompression(CurrentCompression { strength: 6e-4 }),
    Effect::ChannelDelay(ChannelDelay { delay: 3.3e-4 }),
    Effect::SpeedLag(SpeedLag { time: 10e-3 }),
];

/// That motor with effects, at the rig's sampling rate.
pub fn stepper(parameters: Parameters<f32>, effects: &[Effect<f32>]) -> Option<Stepper<f32>> {
    Stepper::build(Motor::build(parameters, effects).ok()?, 1e-4).ok()
}

/// A voltage that starts the motor, runs it, jumps, and lets it stand, with noise on top; and what is imposed
/// meanwhile.
fn motor(parameters: Parameters<f32>, effects: &[Effect<f32>], outputs: &mut Outputs) {
    let Some(mut stepper) = stepper(parameters, effects) else { return };
    let mut noise = Noise(6);
    let mut last = 0.0;
    for n in 0..12_000u32 {
        let triangle = (n % 200) as f32 / 50.0;
        let wave = if triangle < 2.0 { triangle - 1.0 } else { 3.0 - triangle };
        let amplitude = [20.0, 325.0, -40.0, 0.0][(n / 3_000) as usize];
        let voltage = amplitude * wave + noise.uniform::<f32>();
        let constraints = match n / 1_000 {
            2 => Constraints::ROTOR_LOCKED,
            7 => Constraints::SUPPLY_OPEN,
            _ => Constraints::FREE,
        };
        let state = stepper.step(last, voltage, constraints);
        last = voltage;
        let reading = stepper.reading();
        for x in [state.current, state.speed, reading.current, reading.speed] {
            outputs.f32(x);
        }
    }
}

fn motor_universal(outputs: &mut Outputs) {
    motor(MOTOR, &OFFSET, outputs);
}

fn motor_magnet(outputs: &mut Outputs) {
    motor(MAGNET, &OFFSET, outputs);
}

fn motor_effects(outputs: &mut Outputs) {
    motor(MOTOR, &EFFECTS, outputs);
}

fn motor_chain(outputs: &mut Outputs) {
    motor(MOTOR, &CHAIN, outputs);
}

/// Every effect of the catalogue by itself, with values that are small in whatever unit they have, from a speed at
/// which the angle is wrapped every few steps.
fn motor_each_effect(outputs: &mut Outputs) {
    for description in Description::all() {
        let mut values = [0.0; MAX_EFFECT_PARAMETERS];
        for (value, parameter) in values.iter_mut().zip(description.parameters) {
            let (least, greatest) = parameter.range;
            *value = parameter.start.clamp(least, greatest) as f32;
        }
        let effect = Effect::new(description.id, &values);
        let Some(mut stepper) = stepper(MOTOR, &[effect]) else { return };
        stepper.set_state(State { current: 0.5, speed: 2_000.0 });
        let mut noise = Noise(9);
        let mut last = 0.0;
        for _ in 0..SAMPLES {
            let voltage = last + 10.0 * noise.uniform::<f32>();
            stepper.step(last, voltage, Constraints::FREE);
            last = voltage;
            let reading = stepper.reading();
            outputs.f32(reading.current);
            outputs.f32(reading.speed);
        }
    }
}

/// A tick as the rig has it.
pub fn tick() -> Option<Tick> {
    Some(Tick::new(stepper(MOTOR, &OFFSET)?, Settings::default().build().ok()?))
}

fn write(outputs: &mut Outputs, output: Output) {
    let (measured, modelled, residual) = (output.measured, output.modelled, output.residual());
    for x in [measured, modelled, residual] {
        outputs.f32(x.current);
        outputs.f32(x.speed);
    }
}

/// Counts without sense, clipped ones among them.
fn tick_any_counts(outputs: &mut Outputs) {
    let (Some(mut tick), Ok(calibration)) = (tick(), CalibrationSettings::default().build()) else { return };
    let mut noise = Noise(7);
    for _ in 0..4_000 {
        let mut counts = || (noise.bits() % 5_000).min(4_095) as u16;
        let counts = Counts { voltage: counts(), current: counts(), speed: counts() };
        write(outputs, tick.process(calibration.sample(counts), Constraints::FREE));
    }
}

/// Samples of any bits, NaN and infinities among them, between good ones.
fn tick_bad_samples(outputs: &mut Outputs) {
    let Some(mut tick) = tick() else { return };
    let mut noise = Noise(8);
    for _ in 0..4_000 {
        let mut any = || match noise.bits() % 8 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -f32::MAX,
            _ => 300.0 * noise.uniform::<f32>(),
        };
        let sample = Sample { voltage: Volts(any()), current: Amperes(any()), speed: RadiansPerSecond(any()) };
        write(outputs, tick.process(sample, Constraints::FREE));
    }
}

/// The sampling interrupt with all that a station has: two effects, the correction with free b, the detector, whose
/// limits are so tight that everything calls. The model starts at a speed, rad/s.
pub fn full_sampler(shared: &Shared, b: Option<f64>, speed: f32) -> Option<Sampler<'_>> {
    let effects = [
        Effect::Saturation(Saturation { depth: 0.8, knee: 7.4, softness: 1.5, linked: 0.6 }),
        Effect::BrushDrop(BrushDrop { drop: 2.6, transition: 0.28 }),
    ];
    let filter = Settings::default().build().ok()?;
    let mut tick = Tick::new(stepper(MOTOR, &effects)?, filter).with_correction(anfis(Shape::Bell, b, Firing::Product));
    tick.start_from(State { current: 0.0, speed });
    let detector = detector::Settings {
        sample_rate_hz: 10_000.0,
        nominal_voltage: 230.0,
        least_voltage: 0.3,
        most_voltage: 1.1,
        least_speed: 600.0,
        blanking_s: 0.0,
        fewest_periods: 50,
        limits: detector::Limits {
            current: 1e-3,
            speed: 1e-3,
            sparking: 1e-3,
            current_jump: 1e-6,
            speed_jump: 1e-6,
            current_deviation: [0.0, 1e-3],
            speed_deviation: [0.0, 1e-3],
        },
    };
    let calibration = CalibrationSettings::default().build().ok()?;
    Some(Sampler::new(Some(Active { calibration, tick, detector: detector.build().ok() }), shared, &NUCLEO_G474RE))
}

/// A host that wants everything: raw samples, periods, and reports so often that one meets every step of a judgement.
pub fn busy_shared() -> Shared {
    let shared = Shared::new();
    shared.capture(true);
    shared.report(7);
    shared.follow(true);
    shared
}

/// Takes what waits, so that there is room for the next sample's.
pub fn drain(shared: &Shared) {
    while shared.raw.pop().is_some() || shared.judged.pop().is_some() || shared.reports.pop().is_some() {}
}

/// The n-th sample of a square wave of 50 Hz with an unsteady current; now and then everything is clipped.
pub fn counts(n: u16) -> Counts {
    let positive = n % 200 < 100;
    if n % 11 == 5 {
        return Counts { voltage: if positive { 4_095 } else { 0 }, current: 4_095, speed: 4_095 };
    }
    Counts { voltage: if positive { 3_225 } else { 870 }, current: 2_380 + n % 5, speed: 2_785 }
}

/// The n-th sample of a low direct voltage, else as [`counts`].
pub fn direct_counts(n: u16) -> Counts {
    if n % 11 == 5 {
        return Counts { voltage: 4_095, current: 4_095, speed: 4_095 };
    }
    Counts { voltage: 2_120, current: 2_380 + n % 5, speed: 2_785 }
}

/// What the network's instructions depend on.
pub const ANFIS: [(&str, Shape, Option<f64>); 4] = [
    ("anfis_bell_free", Shape::Bell, None),
    ("anfis_bell_1", Shape::Bell, Some(1.0)),
    ("anfis_bell_2", Shape::Bell, Some(2.0)),
    ("anfis_gaussian", Shape::Gaussian, None),
];

/// Voltage (V), current (A) and speed (rad/s) of the rig.
const ANFIS_BOX: [(f64, f64); 3] = [(-325.0, 325.0), (-9.0, 9.0), (0.0, 3_500.0)];

/// A network with parameters drawn at random; `b` where it is not.
fn anfis_settings<const N: usize, const M: usize, const RULES: usize>(
    shape: Shape,
    b: Option<f64>,
    firing: Firing,
) -> anfis::Settings<N, M, RULES> {
    let mut noise = Noise(10);
    let mut draw = || noise.uniform::<f64>();
    let inputs = core::array::from_fn(|i| ANFIS_BOX[i % 3]);
    let premise = inputs.map(|(low, high)| {
        core::array::from_fn(|j| {
            let spacing = (high - low) / (M as f64 - 1.0);
            Premise {
                a: spacing * (0.6 + 0.3 * draw()),
                b: b.unwrap_or(2.0 + 1.5 * draw()),
                c: low + spacing * (j as f64 + 0.2 * draw()),
            }
        })
    });
    anfis::Settings {
        shape,
        firing,
        premise,
        slopes: core::array::from_fn(|_| inputs.map(|(low, high)| draw() / (high - low))),
        constants: core::array::from_fn(|_| draw()),
        inputs,
        output: (-0.7, 0.8),
        margin: 0.1,
    }
}

/// The rig's network.
pub fn anfis(shape: Shape, b: Option<f64>, firing: Firing) -> Option<Anfis3x3> {
    let settings: Settings3x3 = anfis_settings(shape, b, firing);
    settings.build().ok()
}

/// Points up to a fifth outside the box, which is beyond the margin.
fn anfis_points(samples: usize, firing: Firing, outputs: &mut Outputs) {
    let mut noise = Noise(11);
    for (_, shape, b) in ANFIS {
        let Some(network) = anfis(shape, b, firing) else { return };
        for _ in 0..samples {
            let point =
                ANFIS_BOX.map(|(low, high)| (0.5 * (low + high + 1.4 * noise.uniform::<f64>() * (high - low))) as f32);
            let correction = network.correct(point);
            outputs.f32(correction.value);
            outputs.f32(correction.validity);
        }
    }
}

fn anfis_inside(outputs: &mut Outputs) {
    anfis_points(2_000, Firing::Product, outputs);
}

fn anfis_minimum(outputs: &mut Outputs) {
    anfis_points(500, Firing::Minimum, outputs);
}

/// Any bits: NaN, infinities and subnormals are among them.
fn anfis_any_bits(outputs: &mut Outputs) {
    const SPECIAL: [f32; 4] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0];
    let mut noise = Noise(12);
    for (_, shape, b) in ANFIS {
        let Some(network) = anfis(shape, b, Firing::Product) else { return };
        for _ in 0..1_000 {
            let mut any = || match noise.bits() % 8 {
                special @ 0..4 => SPECIAL[special as usize],
                4..6 => f32::from_bits(noise.bits()),
                _ => noise.uniform(),
            };
            let correction = network.correct([any(), any(), any()]);
            outputs.f32(correction.value);
            outputs.f32(correction.validity);
        }
    }
}

fn anfis_f64(outputs: &mut Outputs) {
    let settings: Settings3x3 = anfis_settings(Shape::Bell, None, Firing::Product);
    let Ok(network) = settings.build::<f64>() else { return };
    let mut noise = Noise(13);
    for _ in 0..300 {
        let point = ANFIS_BOX.map(|(low, high)| 0.5 * (low + high + 1.2 * noise.uniform::<f64>() * (high - low)));
        let correction = network.correct(point);
        outputs.f64(correction.value);
        outputs.f64(correction.validity);
    }
}

/// Fewer and more membership functions than the rig's network has.
fn anfis_other_grids(outputs: &mut Outputs) {
    let mut noise = Noise(14);
    let mut write = |correction: anfis::Correction<f32>| outputs.f32(correction.value);
    let (Ok(two), Ok(six)) = (
        anfis_settings::<4, 2, 16>(Shape::Bell, None, Firing::Product).build::<f32>(),
        anfis_settings::<2, 6, 36>(Shape::Bell, None, Firing::Product).build::<f32>(),
    ) else {
        return;
    };
    for _ in 0..500 {
        let [a, b, c, d] = [320.0, 9.0, 1_700.0, 320.0].map(|reach: f32| reach * noise.uniform::<f32>());
        write(two.correct([a, b, c + 1_750.0, d]));
        write(six.correct([a, b]));
    }
}

/// A sequence with lengths and voltages that no sum of powers of two is.
pub fn sequence() -> Option<Sequence> {
    let wave = Wave::Alternating { frequency_hz: 50.0 };
    let segment = |seconds, from_v, to_v| Segment { seconds, from_v, to_v, supplied: Supplied::On };
    let settings = sequence::Settings {
        wave,
        segments: heapless::Vec::from_slice(&[segment(0.0333, 7.7, 311.1), segment(0.0667, 311.1, 101.3)]).ok()?,
        trip_a: 30.0,
        overspeed_rad_s: 4_500.0,
        stuck: Stuck { from_v: 150.0, below_rad_s: 20.0, within_s: 0.1 },
        rest_rad_s: 50.0,
        time_out_s: 2.0,
    };
    let calibration = CalibrationSettings::default().build().ok()?;
    settings.build(&Supply { wave, full_scale_v: 325.0 }, &calibration, &NUCLEO_G474RE).ok()
}

/// What a station switches, as a struct.
#[derive(Default)]
pub struct Gear {
    /// The contacts.
    pub contacts: Contacts,
    /// Whether the hardware has tripped.
    pub tripped: bool,
    command: (bool, f32),
}

impl Switchgear for Gear {
    fn contacts(&mut self) -> Contacts {
        self.contacts
    }

    fn has_tripped(&mut self) -> bool {
        self.tripped
    }

    fn arm(&mut self) {
        self.tripped = false;
    }

    fn trip_outside(&mut self, _: [u16; 2]) {}

    fn supply(&mut self, closed: bool, fraction: f32) {
        self.command = (closed, fraction);
    }
}

/// What the sequence commands in a run.
fn commands(outputs: &mut Outputs) {
    let Some(mut sequence) = sequence() else { return };
    let contacts = Contacts { start: false, abort_closed: true, emergency_closed: true };
    let mut noise = Noise(11);
    for n in 0..3_000 {
        let speed = (noise.bits() % 2_000) as f32;
        let wishes = Wishes { acknowledge: n % 700 == 400, start: n % 700 == 401, abort: n % 1_900 == 1_800 };
        let verdict = Verdict::CannotJudge;
        let seen = Seen { samples: 1, contacts, tripped: false, stood_still: false, speed, wishes, verdict };
        outputs.f32(sequence.step(&seen).fraction);
        outputs.i32(sequence.state().code().into());
    }
}

/// Parameters with something in every section.
fn parameters() -> Option<Parameterised> {
    let ops = [Op::Unknown(0), Op::Current, Op::Mul, Op::Current, Op::Abs, Op::Constant(0.7), Op::Pow, Op::Mul];
    let term = Term::build(Target::Torque, &ops, [1e-3, 0.0, 0.0, 0.0]).ok()?;
    Some(Parameterised {
        motor_type: "VC-1400".try_into().ok()?,
        motor: MOTOR,
        effects: heapless::Vec::from_slice(&EFFECTS).ok()?,
        terms: heapless::Vec::from_slice(&[term]).ok()?,
        ..Parameterised::default()
    })
}

/// The bytes of a block.
fn parameter_block(outputs: &mut Outputs) {
    let mut payload = [0; MAX_PAYLOAD];
    let Some(bytes) = parameters().and_then(|settings| section::encode(&settings, &mut payload).ok()) else { return };
    bytes.iter().for_each(|&byte| outputs.i32(byte.into()));
    outputs.i32(FINGERPRINT.cast_signed());
}

/// Which damaged blocks are refused.
fn damaged_blocks(outputs: &mut Outputs) {
    let mut payload = [0; MAX_PAYLOAD];
    let Some(settings) = parameters() else { return };
    let Ok(length) = section::encode(&settings, &mut payload).map(<[u8]>::len) else { return };
    let mut noise = Noise(10);
    for _ in 0..2_000 {
        let at = noise.bits() as usize % length;
        let Some(byte) = payload.get_mut(at) else { return };
        let good = core::mem::replace(byte, (noise.bits() >> 8) as u8);
        let decoded = section::decode(payload.get(..length).unwrap_or_default());
        outputs.i32(decoded.is_ok().into());
        if let Some(byte) = payload.get_mut(at) {
            *byte = good;
        }
    }
}

/// What the rig computes from flashed parameters and a converter's counts.
fn tick_from_block(outputs: &mut Outputs) {
    let mut payload = [0; MAX_PAYLOAD];
    let Some(bytes) = parameters().and_then(|settings| section::encode(&settings, &mut payload).ok()) else { return };
    let (Ok(settings), Ok(mut bench)) = (section::decode(bytes), Bench::new()) else { return };
    let Ok(mut active) = settings.build() else { return };
    for _ in 0..4_000 {
        let sample = active.calibration.sample(bench.counts());
        write(outputs, active.tick.process(sample, Constraints::FREE));
    }
}
