//! What recordings would have revealed, and which recording would tell more: both against what the physics says.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

use greyrig::effects::EffectId;
use greyrig::motor::BaseParameter;
use greyrig_host::challenge::{Challenge, challenge};
use greyrig_host::context::{Context, Progress};
use greyrig_host::model::{Base, Kind, Model, Parameter, SCHEMA, Status, catalogue};
use greyrig_host::plan::{Contest, Limits, Plan, plan};
use greyrig_host::recording::{Motion, Recording};
use greyrig_host::rig::{Motor, Setup};
use greyrig_host::speed_sensor::Chain;

/// The model with the rig's own parameters.
fn true_model(kind: Kind) -> Model {
    let parameters = Motor::nominal(kind).parameters().map(|(name, value)| {
        let unit = BaseParameter::of_name(name).unwrap().unit(kind.flux_law()).to_owned();
        (name.to_owned(), Parameter { value, unit, ci95: None, status: Status::Identified })
    });
    Model {
        schema: SCHEMA,
        chain: Chain::default(),
        kind,
        base: Base::usual(kind),
        motion: Motion::Rotary,
        motor: None,
        filter: Default::default(),
        parameters: BTreeMap::from(parameters),
        effects: Vec::new(),
        terms: Vec::new(),
        correction: None,
        detector: None,
        accepted: None,
        fitted: None,
        provenance: Default::default(),
    }
}

fn names(ids: &[&str]) -> Vec<EffectId> {
    ids.iter().map(|id| id.parse().unwrap()).collect()
}

fn recorded(profile: &str, effects: &[&str]) -> Vec<Recording> {
    let nominal = Setup::new(Kind::Universal).profile(profile).unwrap().seconds(6.0).seed(11);
    let setup = effects.iter().fold(nominal, |setup, effect| setup.effect(effect).unwrap());
    vec![setup.run().unwrap().recording]
}

fn challenged(recordings: &[Recording], ids: &[&str]) -> Challenge {
    challenge(recordings, &true_model(Kind::Universal), &names(ids), &Context::quiet()).unwrap()
}

/// Counts what is told.
#[derive(Clone, Default)]
struct Tries(Arc<AtomicUsize>);

impl Progress for Tries {
    fn at(&self, _: &str, fraction: Option<f64>) {
        assert!(fraction.is_some_and(|part| part > 0.0 && part <= 1.0), "{fraction:?}");
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

#[test]
fn what_a_staircase_of_a_healthy_motor_reveals() {
    let ids = ["saturation", "brush_drop", "current_offset", "coulomb_friction", "voltage_gain", "torque_offset"];
    let tries = Tries::default();
    let ctx = Context::quiet().watched(tries.clone());
    let c = challenge(&recorded("staircase", &[]), &true_model(Kind::Universal), &names(&ids), &ctx).unwrap();
    assert!(c.found.is_empty() && !c.unexplained, "{:?}", c.found);
    assert_eq!(c.effects.iter().map(|e| e.effect).collect::<Vec<_>>(), ["saturation", "brush_drop", "current_offset"]);
    // The typical size, then bisections of a grid of 16 steps, for each of the three that can be challenged.
    assert!((3..=15).contains(&tries.0.load(Ordering::Relaxed)));
    for e in &c.effects {
        let size = e.revealed_from.unwrap_or_else(|| panic!("{e:?}"));
        // Neighbours on the grid are a factor of √2 apart.
        assert!(e.hidden_up_to.is_none_or(|hidden| (size / hidden - 2f64.sqrt()).abs() < 1e-9), "{e:?}");
        // Nothing that causes an error of 2 % hides from a diagnosis at a floor of 0.06 %.
        assert!(e.esr.current.unwrap() < 0.02, "{e:?}");
    }
    let drop = c.effects.iter().find(|e| e.effect == "brush_drop").unwrap();
    assert!(drop.unit == "V" && (0.02..1.5).contains(&drop.revealed_from.unwrap()), "{drop:?}");
    let reason = |id: &str| c.out_of_reach.iter().find(|o| o.effect == id).unwrap_or_else(|| panic!("{id}"));
    assert!(
        reason("voltage_gain").invisible && reason("voltage_gain").text.contains("a reference meter for the voltage")
    );
    assert!(reason("torque_offset").text.contains("both directions"));
    assert!(reason("coulomb_friction").text.contains("the same already"), "mu0 is dry friction");
}

#[test]
fn a_locked_rotor_hides_the_load_and_shows_the_current() {
    let c = challenged(&recorded("locked", &[]), &["current_compression", "windage_exponent"]);
    let revealed: Vec<_> = c.effects.iter().filter(|e| e.revealed_from.is_some()).map(|e| e.effect).collect();
    assert_eq!(revealed, ["current_compression"], "{:?}", c.effects);
}

#[test]
fn what_diagnosis_finds_anyway_is_taken_in_first() {
    let c = challenged(&recorded("staircase", &["saturation"]), &["current_offset"]);
    assert_eq!(c.found, ["saturation"]);
    assert!(c.effects[0].revealed_from.is_some(), "{:?}", c.effects);
}

#[test]
fn an_effect_that_wins_without_a_challenge_does_not_hide_the_others() {
    let run = Setup::new(Kind::PmDc).profile("dc-steps").unwrap().seconds(6.0).seed(1).run().unwrap().recording;
    let ids = names(&["brush_drop", "current_offset"]);
    let c = challenge(&[run], &true_model(Kind::PmDc), &ids, &Context::quiet()).unwrap();
    assert!(c.effects.iter().all(|e| e.revealed_from.is_some() && e.mistaken_for != Some(EffectId::SpeedLag)), "{c:?}");
}

#[test]
fn effects_that_there_are_not_are_refused() {
    let refused = catalogue::effects(&["saturation".to_owned(), "gremlins".to_owned()]).unwrap_err().to_string();
    assert!(refused.contains("there is no effect 'gremlins'") && refused.contains("brush_drop"), "{refused}");
}

fn planned(kind: Kind, rivals: &[&str]) -> Plan {
    plan(&true_model(kind), &names(rivals), 4.0, Limits::usual(kind), &Context::quiet()).unwrap()
}

static CLASSIC: LazyLock<Plan> = LazyLock::new(|| planned(Kind::Universal, &[]));

fn contest(a: &str) -> &'static Contest {
    CLASSIC.contests.iter().find(|c| c.rivals[0] == a).unwrap()
}

/// What remains of the two rivals in given profiles.
fn remains(contest: &Contest, profiles: &[&str]) -> [f64; 2] {
    let of = |p: &&greyrig_host::plan::Proposal| p.recordings.iter().map(|t| t.profile).eq(profiles.iter().copied());
    contest.proposals.iter().find(of).unwrap_or_else(|| panic!("{profiles:?}")).each
}

#[test]
fn remanence_shows_at_the_terminals_of_the_coasting_motor() {
    let c = contest("remanence");
    let best: Vec<&str> = c.proposals[0].recordings.iter().map(|t| t.profile).collect();
    assert_eq!(best, ["coast-down"], "{:?}", &c.proposals[..3]);
    // A locked rotor has no back-EMF, and nothing of the remanence.
    assert!(remains(c, &["locked"])[0] < 0.01 * remains(c, &["coast-down"])[0]);
    assert!(c.proposals[0].separation > 5.0, "{:?}", c.proposals[0]);
}

#[test]
fn direct_current_leaves_hysteresis_and_no_lag() {
    let c = contest("hysteresis");
    let [hysteresis, eddy] = remains(c, &["dc-ramp"]);
    assert!(hysteresis > 10.0 * eddy, "{hysteresis} {eddy}");
    for sine in ["ramp", "steady", "locked", "coast-down"] {
        let [ac, _] = remains(c, &["staircase", sine]);
        let [dc, _] = remains(c, &["staircase", "dc-ramp"]);
        assert!(dc > 1.3 * ac, "{sine}: {ac}, dc-ramp: {dc}");
    }
}

#[test]
fn brush_drop_remains_most_at_the_locked_rotor() {
    let c = contest("brush_drop");
    let most = c.proposals.iter().map(|p| p.each[0]).fold(0.0, f64::max);
    assert!(remains(c, &["staircase", "locked"])[0].max(remains(c, &["locked"])[0]) >= most, "{most}");
}

#[test]
fn direct_current_shows_the_flux_point_by_point() {
    let best = &contest("saturation").proposals[0];
    assert!(best.recordings.iter().any(|t| t.profile.starts_with("dc-")), "{best:?}");
}

#[test]
fn proposals_keep_to_the_limits_and_come_best_first() {
    for c in &CLASSIC.contests {
        assert!(c.proposals.is_sorted_by(|a, b| a.separation >= b.separation));
        for p in &c.proposals {
            assert!(p.separation <= p.each[0] && p.separation <= p.each[1] && p.separation.is_finite());
            assert!((p.recordings.iter().map(|t| t.seconds).sum::<f64>() - 4.0).abs() < 1e-9);
            for t in &p.recordings {
                assert!(t.peak_voltage_v <= 325.0 && t.peak_current_a <= 10.0, "{t:?}");
            }
        }
    }
    assert!(!CLASSIC.best.is_empty());
}

#[test]
fn magnet_motors_are_planned_for_too() {
    let p = planned(Kind::PmDc, &["current_offset", "voltage_offset"]);
    assert!(p.contests[0].proposals[0].separation > 1.0, "{:?}", p.contests[0].proposals[0]);
    assert!(p.contests[0].proposals.iter().flat_map(|p| &p.recordings).all(|t| t.profile != "phase-angle"));
}

#[test]
fn rivals_that_nothing_tells_apart_are_refused() {
    let refused = |kind, rivals: &[&str]| {
        plan(&true_model(kind), &names(rivals), 4.0, Limits::usual(kind), &Context::quiet()).unwrap_err().to_string()
    };
    assert!(refused(Kind::Universal, &["saturation", "armature_reaction"]).contains("no recording"));
    assert!(refused(Kind::Universal, &["voltage_gain", "saturation"]).contains("a reference meter for the voltage"));
    assert!(refused(Kind::PmDc, &["remanence", "current_offset"]).contains("cannot have remanence"));
}
