//! What is in a block: every value comes back, and nothing that cannot be gets through.

use greyrig::anfis::{Firing, Premise, Settings3x3, Shape};
use greyrig::app::bench::MOTOR;
use greyrig::butterworth;
use greyrig::detector;
use greyrig::effects::{BrushDrop, Effect, EffectId, MAX_EFFECTS, Saturation};
use greyrig::motor::ParameterError;
use greyrig::parameters::Tag;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::rig::MAX_RIG;
use greyrig::parameters::section::{decode, encode};
use greyrig::parameters::{Error, Origin, Rig, Settings};
use greyrig::term::{Op, Target, Term};
use greyrig::units::{CalibrationSettings, Scale};
use proptest::prelude::*;

/// With all that a block may hold, a rig as in those of before.
pub fn settings() -> Settings {
    let mut settings = Settings {
        motor_type: "VC-1400".try_into().unwrap(),
        rig: Some(Rig {
            name: "rig 3, Kranj".try_into().unwrap(),
            calibration: CalibrationSettings {
                voltage: Scale { zero: 2047.3, per_count: 0.195 },
                ..CalibrationSettings::default()
            },
            supply: None,
        }),
        filter: butterworth::Settings { order: 5, cutoff_hz: 333.3, sample_rate_hz: 10_000.0 },
        motor: MOTOR,
        ..Settings::default()
    };
    let saturation = Saturation { depth: 0.8, knee: 7.4, softness: 1.5, linked: 0.6 };
    settings.effects.push(Effect::Saturation(saturation)).unwrap();
    settings.effects.push(Effect::BrushDrop(BrushDrop { drop: 2.6, transition: 0.28 })).unwrap();
    let ops = [Op::Unknown(0), Op::Current, Op::Mul, Op::Current, Op::Abs, Op::Constant(0.5), Op::Pow, Op::Mul];
    settings.terms.push(Term::build(Target::Torque, &ops, [1e-3, 0.0, 0.0, 0.0]).unwrap()).unwrap();
    settings
}

/// The rig of settings that have one.
fn of(settings: &mut Settings) -> &mut Rig {
    settings.rig.as_mut().expect("a rig")
}

fn encoded(settings: &Settings) -> Vec<u8> {
    encode(settings, &mut [0; MAX_PAYLOAD]).expect("it fits").to_vec()
}

/// Where the sections begin, with their tags.
fn sections(payload: &[u8]) -> Vec<(usize, u8, usize)> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < payload.len() {
        let length = usize::from(u16::from_le_bytes([payload[at + 2], payload[at + 3]]));
        found.push((at, payload[at], 4 + length));
        at += 4 + length;
    }
    found
}

#[test]
fn every_value_comes_back() {
    let settings = settings();
    assert_eq!(decode(&encoded(&settings)), Ok(settings));
}

/// A network with numbers that single precision holds.
fn correction() -> Settings3x3 {
    Settings3x3 {
        shape: Shape::Bell,
        firing: Firing::Product,
        premise: [[Premise { a: 0.5, b: 2.0, c: 0.25 }; 3]; 3],
        slopes: core::array::from_fn(|r| [r as f64, -0.5, 0.125]),
        constants: core::array::from_fn(|r| 0.25 * r as f64),
        inputs: [(-1.0, 1.0); 3],
        output: (-2.0, 2.0),
        margin: 0.125,
    }
}

fn detector() -> detector::Settings {
    detector::Settings {
        sample_rate_hz: 10_000.0,
        nominal_voltage: 230.0,
        least_voltage: 0.3,
        most_voltage: 1.1,
        least_speed: 600.0,
        blanking_s: 1.0,
        fewest_periods: 50,
        limits: detector::Limits { current: 0.02, sparking: 0.01, ..detector::Limits::default() },
    }
}

#[test]
fn correction_and_limits_come_back_and_are_checked() {
    let full = Settings { correction: Some(correction()), detector: Some(detector()), ..settings() };
    assert_eq!(decode(&encoded(&full)), Ok(full.clone()));
    let mut narrow = correction();
    narrow.premise[0][0].a = 0.0;
    let bad = Settings { correction: Some(narrow), ..settings() };
    assert!(matches!(decode(&encoded(&bad)), Err(Error::Correction(_))));
    let slow = detector::Settings { sample_rate_hz: 5_000.0, ..detector() };
    assert_eq!(decode(&encoded(&Settings { detector: Some(slow), ..settings() })), Err(Error::SampleRate));
    let none = detector::Settings { nominal_voltage: 0.0, ..detector() };
    let bad = Settings { detector: Some(none), ..settings() };
    assert_eq!(decode(&encoded(&bad)), Err(Error::Detector(detector::SettingsError::Voltage)));
}

/// The bytes of version 1 of every section, written down: whoever changes them has to raise a version. (Postcard 1.0:
/// an enumeration is its variant's number, a string its length and bytes, an `f32` or `f64` its bits, little-endian.)
#[test]
fn bytes_of_version_1() {
    let payload = encoded(&settings());
    let mut expected = vec![1, 1, 21, 0, 7];
    expected.extend(b"VC-1400");
    expected.push(12);
    expected.extend(b"rig 3, Kranj");
    expected.extend([2, 1, 24, 0]);
    let default = CalibrationSettings::default();
    for value in [2047.3, 0.195, default.current.zero, default.current.per_count, default.speed.zero] {
        expected.extend(value.to_le_bytes());
    }
    expected.extend(default.speed.per_count.to_le_bytes());
    expected.extend([3, 1, 17, 0, 5]);
    expected.extend(333.3_f64.to_le_bytes());
    expected.extend(10_000.0_f64.to_le_bytes());
    expected.extend([4, 1, 29, 0, 0]);
    for value in [2.2_f32, 20e-3, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8] {
        expected.extend(value.to_le_bytes());
    }
    expected.extend([5, 1, 55, 0, 2, 10]);
    expected.extend(b"saturation");
    for value in [0.8_f32, 7.4, 1.5, 0.6] {
        expected.extend(value.to_le_bytes());
    }
    expected.push(10);
    expected.extend(b"brush_drop");
    for value in [2.6_f32, 0.28, 0.0, 0.0] {
        expected.extend(value.to_le_bytes());
    }
    expected.extend([6, 1, 32, 0, 1, 1, 8, 1, 0, 2, 7, 2, 11, 0]);
    expected.extend(0.5_f32.to_le_bytes());
    expected.extend([9, 7]);
    for value in [1e-3_f32, 0.0, 0.0, 0.0] {
        expected.extend(value.to_le_bytes());
    }
    assert_eq!(payload, expected);
}

#[test]
fn the_fullest_block_fits() {
    let mut settings = settings();
    settings.motor_type = "m".repeat(32).as_str().try_into().unwrap();
    of(&mut settings).name = "r".repeat(32).as_str().try_into().unwrap();
    let longest = EffectId::ALL.iter().copied().max_by_key(|id| id.id().len()).unwrap();
    settings.effects.clear();
    while settings.effects.len() < MAX_EFFECTS {
        settings.effects.push(Effect::new(longest, &[])).unwrap();
    }
    let mut ops = vec![Op::Current];
    ops.extend([Op::Abs; 31]);
    settings.terms.clear();
    for _ in 0..2 {
        settings.terms.push(Term::build(Target::Voltage, &ops, [0.0; 4]).unwrap()).unwrap();
    }
    settings.correction = Some(correction());
    settings.detector = Some(detector());
    settings.origin = Some(Origin { greyrig: "0".repeat(32).as_str().try_into().unwrap(), build: [0xFF; 8] });
    assert_eq!(decode(&encoded(&settings)), Ok(settings));
}

#[test]
fn sections_that_are_unknown_missing_or_repeated_are_refused() {
    let payload = encoded(&settings());
    for (at, tag, length) in sections(&payload) {
        let mut newer = payload.clone();
        newer[at + 1] = 2;
        assert_eq!(decode(&newer), Err(Error::Unsupported { tag, version: 2 }));
        let without: Vec<u8> = [&payload[..at], &payload[at + length..]].concat();
        if tag == Tag::Calibration as u8 {
            assert_eq!(decode(&without), Ok(Settings { rig: None, ..settings() }), "the rig has it");
        } else {
            assert!(matches!(decode(&without), Err(Error::Missing(missing)) if missing as u8 == tag));
        }
        let twice: Vec<u8> = [&payload[..], &payload[at..at + length]].concat();
        assert!(matches!(decode(&twice), Err(Error::Repeated(repeated)) if repeated as u8 == tag));
    }
    let further: Vec<u8> = [&payload[..], &[99, 1, 0, 0]].concat();
    assert_eq!(decode(&further), Err(Error::Unsupported { tag: 99, version: 1 }));
    let elsewhere: Vec<u8> = [&payload[..], &[Tag::Rig as u8, 1, 1, 0, 0]].concat();
    assert_eq!(decode(&elsewhere), Err(Error::Elsewhere(Tag::Rig)));
    let empty: Vec<u8> = [&payload[..], &[Tag::Detector as u8, 1, 0, 0]].concat();
    assert_eq!(decode(&empty), Err(Error::Malformed(Tag::Detector)));
    for cut in 1..payload.len() {
        assert!(decode(&payload[..cut]).is_err(), "cut at {cut}");
    }
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut Settings)| {
        let mut settings = settings();
        change(&mut settings);
        decode(&encoded(&settings)).expect_err("it is refused").to_string()
    };
    assert!(refused(|s| s.motor.resistance = -1.0).starts_with("R must lie between"));
    assert!(refused(|s| s.motor.inertia = f32::NAN).starts_with("J is not a finite"));
    assert!(refused(|s| s.motor.inertia = 2e-10).contains("faster than the sampling"));
    assert!(refused(|s| s.filter.order = 9).contains("order"));
    assert!(refused(|s| s.filter.cutoff_hz = 6e3).contains("cutoff_hz"));
    assert!(refused(|s| of(s).calibration.speed.per_count = 0.0).contains("speed"));
    assert!(refused(|s| of(s).calibration.current.zero = f32::INFINITY).contains("current"));
    for gain in [-1e18, 1e4, 1e-9, -0.0, f32::NAN, f32::INFINITY] {
        let mut settings = settings();
        of(&mut settings).calibration.current.per_count = gain;
        let told = decode(&encoded(&settings)).expect_err("it is refused").to_string();
        assert!(told.starts_with("calibration of the current"), "{gain}: {told}");
    }
    assert!(refused(|s| of(s).calibration.voltage.zero = -1e5).contains("voltage"));
    // A sensor that was built in the other way round, and a live zero.
    let mut turned = settings();
    of(&mut turned).calibration.current = Scale { zero: 819.0, per_count: -0.02 };
    assert_eq!(decode(&encoded(&turned)), Ok(turned));
    assert!(refused(|s| of(s).name = "a\nb".try_into().unwrap()).contains("rig"));
    assert!(refused(|s| s.effects[0] = Effect::BrushDrop(BrushDrop { drop: -1e9, transition: 0.1 })).contains("drop"));
    let term = |s: &mut Settings| s.terms[0] = s.terms[0].with_unknowns([f32::NAN; 4]);
    assert!(refused(term).contains("term"));
    assert_eq!(
        Settings::default().build().map(|_| ()),
        Err(Error::Motor(ParameterError::OutOfRange { name: "R", least: 1e-4, greatest: 1e5 }))
    );
}

#[test]
fn an_effect_of_a_longer_catalogue_is_refused() {
    let mut payload = encoded(&settings());
    let at = payload.windows(10).position(|w| w == b"saturation").unwrap();
    payload[at] = b'S';
    assert_eq!(decode(&payload), Err(Error::UnknownEffect(0)));
}

proptest! {
    #[test]
    fn any_bytes_are_refused_or_make_a_rig(mut payload in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = decode(&payload);
        // Bytes that look like a section get further.
        payload.splice(0..0, [1, 1, 2, 0, 0, 0, 6, 1]);
        if let Ok(settings) = decode(&payload) {
            prop_assert!(settings.build().is_ok());
        }
    }

    #[test]
    fn damaged_payloads_never_panic(at in 0_usize..230, byte in any::<u8>()) {
        let mut payload = encoded(&settings());
        let at = at % payload.len();
        payload[at] = byte;
        if let Ok(settings) = decode(&payload) {
            prop_assert!(settings.build().is_ok());
        }
    }
}

/// The bytes of a rig's block and of a motor's origin in version 1, written down as those of the motor's above.
#[test]
fn a_rigs_block_comes_back_whole_or_is_refused() {
    let origin = Origin { greyrig: "0.2.0".try_into().unwrap(), build: [1, 2, 3, 4, 5, 6, 7, 8] };
    let written = encoded(&Settings { origin: Some(origin.clone()), ..settings() });
    let last = [10, 1, 14, 0, 5].iter().chain(b"0.2.0").chain(&origin.build).copied().collect::<Vec<u8>>();
    assert!(written.ends_with(&last), "{written:?}");
    assert_eq!(decode(&written).unwrap().origin, Some(origin));
    let rig = settings().rig.unwrap();
    let payload = rig.encode(&mut [0; MAX_RIG]).unwrap().to_vec();
    let mut expected = vec![9, 1, 13, 0, 12];
    expected.extend(b"rig 3, Kranj");
    expected.extend([2, 1, 24, 0]);
    for scale in [rig.calibration.voltage, rig.calibration.current, rig.calibration.speed] {
        expected.extend(scale.zero.to_le_bytes());
        expected.extend(scale.per_count.to_le_bytes());
    }
    assert_eq!(payload, expected);
    assert_eq!(Rig::decode(&payload), Ok(rig.clone()));
    for cut in 0..payload.len() {
        assert!(Rig::decode(&payload[..cut]).is_err(), "cut at {cut}");
    }
    let motor = [&payload[..], &[Tag::Terms as u8, 1, 1, 0, 0]].concat();
    assert_eq!(Rig::decode(&motor), Err(Error::Elsewhere(Tag::Terms)));
    let longest = Rig { name: "r".repeat(32).as_str().try_into().unwrap(), ..rig };
    assert_eq!(Rig::decode(longest.encode(&mut [0; MAX_RIG]).unwrap()), Ok(longest));
}
