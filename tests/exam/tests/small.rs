//! A small examination: the figures of docs/exam.md are those of many more cases.

use greyrig::effects::EffectId;
use greyrig_exam::cases::{Case, Excitation, Question};
use greyrig_exam::ending::{Steps, follow};
use greyrig_exam::lot::{MotorType, Onset};
use greyrig_exam::rig::{self, KINDS};
use greyrig_exam::score::{Outcome, run};
use greyrig_exam::share::Share;
use greyrig_host::diagnose::VerdictKind;
use greyrig_host::model::Kind;
use greyrig_host::monitor::test::Outcome as Judged;
use greyrig_host::rig::{PROFILES, Profile};
use rayon::prelude::*;

fn ask(question: Question, seeds: std::ops::Range<u64>) -> Vec<Outcome> {
    ask_of(Excitation::Ac, question, seeds)
}

fn ask_of(excitation: Excitation, question: Question, seeds: impl IntoParallelIterator<Item = u64>) -> Vec<Outcome> {
    seeds.into_par_iter().map(|seed| run(&Case::new(question, excitation, 1.0, seed)).unwrap()).collect()
}

/// Error-to-signal ratios of a healthy motor on this excitation, current and speed: three times these stand out.
const HEALTHY: [f64; 2] = [0.0006, 0.0002];

#[test]
fn one_hidden_effect_is_named() {
    let outcomes = ask(Question::One, 9_001..9_013);
    let out: Vec<&Outcome> = outcomes.iter().filter(|o| o.stands_out(HEALTHY)).collect();
    assert!(out.len() >= 6, "only {} stand out", out.len());
    for o in out {
        // The aim is 97 %; of a dozen cases none may fail.
        assert!(o.first_right(), "{:?}: {:?} {:?}", o.effects, o.kind, o.named);
    }
}

#[test]
fn one_of_the_rarer_effects_is_named() {
    for (excitation, seeds) in [(Excitation::Ac, [4_002, 4_004, 4_007]), (Excitation::Magnet, [4_001, 4_002, 4_005])] {
        for o in ask_of(excitation, Question::Rarer, seeds) {
            assert!(o.exact(), "{} {:?}: {:?} {:?}", o.seed, o.effects, o.kind, o.named);
        }
    }
}

#[test]
fn healthy_motors_are_not_accused() {
    for o in ask(Question::None, 9_101..9_109) {
        assert_eq!(o.kind, VerdictKind::None, "seed {}: {:?}", o.seed, o.named);
    }
}

#[test]
fn healthy_motors_are_not_accused_on_any_profile_alone() {
    for (kind, seed) in [(Kind::Universal, 9_111), (Kind::PmDc, 9_112)] {
        let profiles: Vec<&Profile> = PROFILES.iter().filter(|p| p.pm_dc || kind == Kind::Universal).collect();
        let cases = profiles.into_par_iter().map(|p| (p, Case::usual(None, Excitation::Alone(kind, p), seed)));
        cases.for_each(|(profile, case)| {
            let o = run(&case).unwrap();
            let accused = !matches!(o.kind, VerdictKind::None | VerdictKind::InsufficientData);
            assert!(!accused, "{kind} on {}, {}: {:?} {:?}", profile.id, o.seed, o.kind, o.named);
        });
    }
}

#[test]
fn an_effect_that_the_catalogue_lacks_is_not_called_by_another_name() {
    let outcomes = ask(Question::Withheld, 9_201..9_206);
    let wrong: Vec<_> =
        outcomes.iter().filter(|o| o.stands_out(HEALTHY) && o.kind == VerdictKind::MissingEffect).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn weak_eddy_currents_are_no_transformer_emf_that_does_not_fade() {
    let o = &ask_of(Excitation::Set, Question::Withheld, [7])[0];
    assert_eq!(
        (o.truth.as_slice(), o.kind),
        (&[EffectId::EddyCurrent][..], VerdictKind::OutsideCatalogue),
        "{:?}",
        o.named
    );
}

#[test]
fn a_direct_start_misleads_neither_the_balances_nor_their_fits() {
    // 63: saturation, of which a quick fit ends in a wrong valley, far from a base that the inrush alone has decided.
    // 232: a lag of the speed, which the balances undo to first order only; they name iron loss, and the free run drops
    // it.
    for (seed, truth) in [(63, EffectId::Saturation), (232, EffectId::SpeedLag)] {
        let o = &ask_of(Excitation::Start, Question::One, [seed])[0];
        assert_eq!(o.truth, [truth]);
        assert!(o.exact(), "seed {seed}: {:?} {:?}", o.kind, o.named);
    }
}

#[test]
fn a_healthy_magnet_motor_is_not_accused() {
    for o in ask_of(Excitation::Magnet, Question::None, 9_101..9_107) {
        assert_eq!(o.kind, VerdictKind::None, "seed {}: {:?}", o.seed, o.named);
    }
}

#[test]
fn an_effect_of_a_magnet_motor_is_named() {
    // 4: an inrush alone clips. 8: a dead zone, beside coast-downs in which it does nothing. 12: heat, of a current
    // whose largest value is twenty times its mean. 13: a resistance that grows with a power of the speed between those
    // of the catalogue.
    for o in ask_of(Excitation::Magnet, Question::One, [2, 4, 8, 12, 13, 19]) {
        assert!(o.exact(), "seed {}, {:?}: {:?} {:?}", o.seed, o.effects, o.kind, o.named);
    }
}

#[test]
fn three_effects_are_found_where_the_balances_mislead() {
    // 31: the torque balance is left with twice its floor, the speed of the free run with no more than turbulence.
    // 193: windage and Stribeck friction gain nothing one at a time, and hardly show in the torque balance.
    // 228: the same two, bent so far that no linearisation shows what they gain together.
    // 163: hysteresis, fitted to the balances before the compression of the sensor is known, ends in another valley.
    [31, 193, 228, 163].into_par_iter().for_each(|seed| {
        let o = run(&Case::new(Question::Three, Excitation::Ac, 1.0, seed)).unwrap();
        assert!(o.exact(), "seed {seed}, {:?}: {:?} {:?}", o.effects, o.kind, o.named);
    });
}

#[test]
fn what_is_chosen_while_others_are_missing_is_given_for_what_is_there() {
    // Of five effects. 11: a dead zone, named for what a brush drop leaves. 26: the same, and the climb ends with it
    // far from the floor.
    [11, 26].into_par_iter().for_each(|seed| {
        let o = run(&Case::new(Question::Five, Excitation::Ac, 1.0, seed)).unwrap();
        assert!(o.exact(), "seed {seed}, {:?}: {:?} {:?}", o.effects, o.kind, o.named);
    });
}

#[test]
fn what_is_named_and_added_is_not_missed_again() {
    // Two effects each; of cases 301 to 308 those that are named exactly.
    [302, 304, 305].into_par_iter().for_each(|seed| {
        let case = Case::new(Question::Two, Excitation::Ac, 1.0, seed);
        let ending = follow(&case, &run(&case).unwrap(), Steps::AllAtOnce).unwrap();
        assert!(ending.is_none(), "{ending}");
    });
}

#[test]
fn wilson_intervals_are_those_of_the_tables() {
    // R. G. Newcombe, Statistics in Medicine 17 (1998) 857-872, table I, method 3: 81/263 and 0/20.
    let [low, high] = Share { hits: 81, cases: 263 }.wilson();
    assert!((low - 0.2553).abs() < 1e-4 && (high - 0.3662).abs() < 1e-4, "{low} {high}");
    let [low, high] = Share { hits: 0, cases: 20 }.wilson();
    assert!(low.abs() < 1e-4 && (high - 0.1611).abs() < 1e-4, "{low} {high}");
}

#[test]
fn a_lot_passes_and_its_gross_faults_fail() {
    let of = MotorType { saturation: 0.25, staircases: 1 };
    let stations = of.stations().unwrap();
    let last = stations.last().unwrap();
    (0..8u64).into_par_iter().for_each(|seed| {
        let test = last.test(&of.motor(seed, None, Onset::During).unwrap().0).unwrap();
        assert_eq!(test.verdict, Judged::Pass, "motor {seed}: {:?}", test.alarms);
    });
    for (id, size) in [("sparking", 0.1), ("resistance_up", 0.2), ("fan_load", -0.1)] {
        let test = last.test(&of.motor(3_000_000, Some((id, size)), Onset::During).unwrap().0).unwrap();
        assert_eq!(test.verdict, Judged::Fail, "{id}");
    }
}

/// Kinds of damage that are found in 95 of 100 and more (`cargo xtask exam --only 'rig-*'`).
const FOUND: [&str; 28] = [
    "sign-u",
    "sign-i",
    "sign-w",
    "dead-u",
    "dead-i",
    "dead-w",
    "supply-u",
    "commanded-u",
    "milli-u",
    "rpm-with-angle",
    "deg-s",
    "gap",
    "resampled",
    "clipped-i",
    "clipped-w",
    "unipolar-w",
    "overrange",
    "stuck",
    "coarse",
    "counts",
    "period",
    "held",
    "averaged",
    "silent",
    "magnitude",
    "hum",
    "drift",
    "twice",
];

#[test]
fn what_others_do_to_a_recording_is_named() {
    let asked: Vec<_> = KINDS.iter().filter(|kind| FOUND.contains(&kind.name)).collect();
    assert_eq!(asked.len(), FOUND.len());
    let missed: Vec<String> = asked
        .into_par_iter()
        .flat_map_iter(|kind| {
            let answers: Vec<rig::Answer> = (9_301..9_305).map(|seed| rig::ask(kind, seed).unwrap()).collect();
            let missed = answers.into_iter().filter(|a| !a.named);
            let missed: Vec<String> = missed.map(|a| format!("{}: {} {}", kind.name, a.title, a.damage)).collect();
            // Of four that are found nineteen times of twenty, two are missed once in seventy kinds.
            if missed.len() > 1 { missed } else { Vec::new() }
        })
        .collect();
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn nothing_is_said_against_sound_recordings() {
    let sound = KINDS.iter().find(|kind| kind.name == "sound").unwrap();
    let alarms: Vec<String> = (9_301..9_333)
        .into_par_iter()
        .map(|seed| rig::ask(sound, seed).unwrap())
        .filter(|answer| answer.false_alarms(sound) > 0)
        .map(|answer| format!("{}: {:?}", answer.title, answer.findings))
        .collect();
    // One of a hundred may.
    assert!(alarms.len() <= 1, "{alarms:#?}");
}
