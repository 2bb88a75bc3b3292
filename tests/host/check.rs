//! `greyrig check`: recordings of the virtual rig, damaged as recordings of others are, and sound ones that must pass.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::LazyLock;

use greyrig_host::check::{check, same, stop};
use greyrig_host::context::Context;
use greyrig_host::recording::finding::{Code, DataFinding, Severity};
use greyrig_host::recording::{Channel, Mapping, Recording, load};
use greyrig_host::rig::logger::one_of;
use greyrig_host::rig::{Kind, Motor, PROFILES, Setup};

use crate::random::Random;

fn greyrig(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .args(arguments)
        .output()
        .expect("greyrig runs")
}

struct Sound {
    kind: Kind,
    profile: &'static str,
    recording: Recording,
}

/// Sound recordings: every profile of both kinds, units of a lot, 10 kHz.
static SOUND: LazyLock<Vec<Sound>> = LazyLock::new(|| {
    let mut all = Vec::new();
    for kind in [Kind::PmDc, Kind::Universal] {
        for profile in PROFILES.iter().filter(|p| p.pm_dc || kind == Kind::Universal) {
            for seed in 0..2 {
                let motor = Motor::sample_from_population(&Motor::nominal(kind), 0.1, seed);
                let setup = Setup::new(kind).motor(motor).profile(profile.id).unwrap().seconds(4.0).seed(seed);
                let path = format!("{}-{}-{seed}", kind.name(), profile.id);
                all.push(Sound { kind, profile: profile.id, recording: setup.run().unwrap().recording.named(path) });
            }
        }
    }
    all
});

/// The motor turns, and its voltage is not a single one.
fn driven() -> impl Iterator<Item = &'static Sound> {
    SOUND.iter().filter(|s| !["locked", "start", "coast-down"].contains(&s.profile))
}

fn change(recording: &Recording, channel: Channel, f: impl FnOnce(&mut Vec<f64>)) -> Recording {
    let mut changed = recording.clone();
    let mut values = recording.channel(channel).unwrap().to_vec();
    f(&mut values);
    changed.set_channel(channel, values).unwrap();
    changed
}

fn times(recording: &Recording, channel: Channel, factor: f64) -> Recording {
    change(recording, channel, |x| x.iter_mut().for_each(|x| *x *= factor))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

fn of(found: &[DataFinding], code: Code) -> Option<&DataFinding> {
    found.iter().find(|f| f.code == code)
}

/// Damages sound recordings, one of each two units, and counts those that are named so. Nineteen of twenty have to be.
fn found(what: &str, code: Code, channel: Option<Channel>, damage: impl Fn(&Sound, &mut Random) -> Option<Recording>) {
    let mut random = Random(1);
    let (mut named, mut missed) = (0, Vec::new());
    for sound in driven().step_by(2) {
        let Some(damaged) = damage(sound, &mut random) else { continue };
        let findings = check(&[damaged], Some(sound.kind));
        // Counts that are held over their window are told as held where the counts themselves are not proved.
        let also = if code == Code::EncoderCounts { Code::HeldValues } else { code };
        let told = |code: Code| of(&findings, code).is_some_and(|f| channel.is_none_or(|c| f.channel == Some(c)));
        let hit = told(code) || told(also);
        if hit {
            named += 1;
        } else {
            let codes: Vec<String> = findings.iter().map(|f| format!("{} {:?}", f.code, f.channel)).collect();
            missed.push(format!("{}: {codes:?}", sound.recording.path().display()));
        }
    }
    println!("| {what} ({code}) | {named} of {} |", named + missed.len());
    assert!(named >= 5 && named >= 19 * missed.len(), "{what}: {named} found, missed {missed:#?}");
}

#[test]
fn sound_recordings_pass_at_any_rate() {
    let (mut recordings, mut warnings) = (0, Vec::new());
    for sound in SOUND.iter() {
        // A supply of 50 Hz needs more than 100 samples a second.
        let fastest_only = sound.kind == Kind::Universal || sound.profile == "locked";
        for factor in [1, 5, 10, 50, 200].into_iter().filter(|n| !fastest_only || *n <= 10) {
            let found = check(&[one_of(&sound.recording, factor).unwrap()], Some(sound.kind));
            assert_eq!(stop(&found), None, "{} / {factor}", sound.recording.path().display());
            recordings += 1;
            warnings.extend(found.into_iter().filter(|f| f.severity == Severity::Warning));
        }
    }
    // One in a hundred.
    assert!(warnings.len() * 100 <= recordings, "{recordings}: {warnings:#?}");
}

#[test]
fn a_reversed_sign_is_found_and_mended() {
    let magnet = |s: &Sound| s.kind == Kind::PmDc;
    for channel in [Channel::Voltage, Channel::Current, Channel::Speed] {
        found("sign", Code::SignReversed, Some(channel), |s, _| {
            (magnet(s) || channel == Channel::Speed).then(|| times(&s.recording, channel, -1.0))
        });
    }
    // Which of voltage and current it is a series motor cannot tell.
    found("sign", Code::SignReversed, Some(Channel::Current), |s, _| {
        (!magnet(s)).then(|| times(&s.recording, Channel::Voltage, -1.0))
    });
}

#[test]
fn swapped_and_dead_channels_are_found() {
    found("swapped", Code::ChannelsSwapped, None, |s, _| {
        let mut swapped = s.recording.clone();
        swapped.set_channel(Channel::Voltage, s.recording.channel(Channel::Current)?.to_vec()).unwrap();
        swapped.set_channel(Channel::Current, s.recording.channel(Channel::Voltage)?.to_vec()).unwrap();
        Some(swapped)
    });
    found("dead current", Code::ChannelDead, Some(Channel::Current), |s, random| {
        let noise = random.between(0.001, 0.1);
        Some(change(&s.recording, Channel::Current, |x| x.iter_mut().for_each(|x| *x = noise * random.gaussian())))
    });
    found("dead voltage", Code::ChannelDead, Some(Channel::Voltage), |s, _| {
        Some(times(&s.recording, Channel::Voltage, 0.0))
    });
    for sound in driven() {
        let findings = check(&[times(&sound.recording, Channel::Speed, 0.0)], Some(sound.kind));
        // With a slow voltage alone, current and voltage go together as those of a large resistance.
        let told = of(&findings, Code::ChannelDead).or_else(|| of(&findings, Code::Standstill));
        assert_eq!(told.and_then(|f| f.channel), Some(Channel::Speed), "{}", sound.recording.path().display());
        // A set point in place of a measurement is no motor at rest.
        let stuck = change(&sound.recording, Channel::Speed, |w| w.fill(300.0));
        let findings = check(&[stuck], Some(sound.kind));
        let told = of(&findings, Code::ChannelDead).or_else(|| of(&findings, Code::Standstill)).unwrap();
        assert!(told.text.contains("300 rad/s in every sample"), "{}", told.text);
    }
}

#[test]
fn a_coast_down_from_full_speed_is_no_dead_sensor() {
    // A magnet motor that is at full speed within 50 ms, and has its supply opened after 2.4 s of 8 s.
    let (rate, mut random) = (10_000, Random(3));
    let (r, l, k, j, dry, viscous) = (0.6, 6e-4, 0.06, 8e-5, 0.02, 2e-5);
    let (mut i, mut w) = (0.0f64, 0.0f64);
    let (mut channels, mut open) = ([const { Vec::new() }; 3], Vec::new());
    for n in 0..8 * rate {
        let is_open = n >= 24 * rate / 10;
        let u = if is_open { k * w } else { 24.0 };
        let noise = [0.02, 0.05, 0.2].map(|size| size * random.gaussian());
        channels.iter_mut().zip([u, i, w]).zip(noise).for_each(|((channel, x), noise)| channel.push(x + noise));
        open.push(is_open);
        let torque = k * i - viscous * w - dry;
        w = (w + torque / j / f64::from(rate)).max(0.0);
        i = if is_open { 0.0 } else { i + (u - r * i - k * w) / l / f64::from(rate) };
    }
    let [u, i, w] = channels;
    let builder = Recording::builder(1.0 / f64::from(rate)).supply_open(open);
    let builder = builder.channel(Channel::Voltage, u).channel(Channel::Current, i).channel(Channel::Speed, w);
    let findings = check(&[builder.build().unwrap()], Some(Kind::PmDc));
    assert_eq!(stop(&findings), None, "{findings:?}");
}

#[test]
fn units_and_the_kind_of_motor_are_doubted() {
    found("deg/s", Code::ScaleSuspect, Some(Channel::Speed), |s, _| Some(times(&s.recording, Channel::Speed, 57.296)));
    found("mV", Code::ScaleSuspect, Some(Channel::Voltage), |s, _| Some(times(&s.recording, Channel::Voltage, 1e3)));
    found("us", Code::TimeUnit, None, |s, _| {
        let builder = Recording::builder(s.recording.sample_time_s() * 1e6);
        let channels = s.recording.channels();
        channels.iter().fold(builder, |b, (c, x)| b.channel(*c, x.clone())).build().ok()
    });
    found("rpm beside an angle", Code::UnitSuspect, Some(Channel::Speed), |s, _| {
        let mut angle = 0.0;
        let turned = s.recording.channel(Channel::Speed)?.iter().map(|w| {
            angle += w * s.recording.sample_time_s();
            angle
        });
        let turned: Vec<f64> = turned.collect();
        let mut run = times(&s.recording, Channel::Speed, 60.0 / std::f64::consts::TAU);
        run.set_channel(Channel::Angle, turned).unwrap();
        Some(run)
    });
    // A steady run has one voltage nearly throughout.
    for sound in driven().filter(|s| s.profile != "steady").step_by(2) {
        let other = if sound.kind == Kind::PmDc { Kind::Universal } else { Kind::PmDc };
        let findings = check(std::slice::from_ref(&sound.recording), Some(other));
        assert!(of(&findings, Code::WrongKind).is_some(), "{}", sound.recording.path().display());
    }
}

#[test]
fn what_a_converter_does_is_found_and_rest_is_left_alone() {
    found("clipped", Code::Clipped, Some(Channel::Current), |s, random| {
        let limit = random.between(0.4, 0.8) * largest(s.recording.channel(Channel::Current)?);
        let beyond = s.recording.channel(Channel::Current)?.iter().filter(|i| i.abs() > limit).count();
        (beyond > 400)
            .then(|| change(&s.recording, Channel::Current, |x| x.iter_mut().for_each(|x| *x = x.clamp(-limit, limit))))
    });
    found("codes", Code::Overrange, Some(Channel::Current), |s, random| {
        Some(change(&s.recording, Channel::Current, |x| {
            (0..3).for_each(|_| {
                let n = (random.next() * x.len() as f64) as usize;
                x[n] = 9.9e37;
            });
        }))
    });
    found("spikes", Code::Outliers, Some(Channel::Current), |s, random| {
        let peak = largest(s.recording.channel(Channel::Current)?);
        Some(change(&s.recording, Channel::Current, |x| {
            (0..8).for_each(|_| {
                let n = (random.next() * x.len() as f64) as usize;
                x[n] += peak * random.between(0.5, 1.5);
            });
        }))
    });
    found("encoder", Code::EncoderCounts, Some(Channel::Speed), |s, random| {
        if s.kind != Kind::PmDc {
            return None;
        }
        let window = random.between(20.0, 100.0) as usize;
        let step = std::f64::consts::TAU / [120.0, 360.0, 500.0][(3.0 * random.next()) as usize];
        let mut angle = 0.0;
        Some(change(&s.recording, Channel::Speed, |x| {
            let counts = x.iter().map(|w| {
                angle += w * 1e-4;
                (angle / step).floor()
            });
            let counts: Vec<f64> = counts.collect();
            for (n, x) in x.iter_mut().enumerate() {
                let last = n / window * window;
                let seen = if last >= window { counts[last] - counts[last - window] } else { 0.0 };
                *x = seen * step / (window as f64 * 1e-4);
            }
        }))
    });
    // A converter without a negative side shows rest as zero, noise cut in half: nothing is clipped.
    for sound in SOUND.iter().filter(|s| s.kind == Kind::Universal) {
        let cut = change(&sound.recording, Channel::Speed, |x| x.iter_mut().for_each(|x| *x = x.max(0.0)));
        let findings = check(&[cut], Some(sound.kind));
        assert_eq!(of(&findings, Code::Clipped), None, "{}", sound.recording.path().display());
    }
}

#[test]
fn two_recordings_without_current_whose_speeds_are_of_other_units_are_told() {
    let without_current = |kind: Kind, factor: f64| {
        let mut recording =
            SOUND.iter().find(|s| s.kind == kind && s.profile == "staircase").unwrap().recording.clone();
        recording.remove_channel(Channel::Current);
        times(&recording, Channel::Speed, factor).named(format!("times {factor}"))
    };
    // Degrees a second taken for radians a second in one of the two, and half of the volts.
    for factor in [57.3, 0.5] {
        for kind in [Some(Kind::PmDc), None] {
            let found = check(&[without_current(Kind::PmDc, 1.0), without_current(Kind::PmDc, factor)], kind);
            assert!(of(&found, Code::DifferentMotors).is_some(), "{factor} {kind:?}: {found:?}");
        }
    }
    let told = |kind, factor, asked| {
        let found = check(&[without_current(kind, 1.0), without_current(kind, factor)], asked);
        of(&found, Code::DifferentMotors).cloned()
    };
    assert_eq!(told(Kind::PmDc, 1.1, None), None);
    // The speed of a universal motor on the mains does not go with the voltage.
    assert_eq!(told(Kind::Universal, 0.5, None), None);
    assert_eq!(told(Kind::PmDc, 0.5, Some(Kind::Universal)), None);
}

#[test]
fn a_supply_that_steps_within_a_period_has_lost_nothing_and_one_whose_phase_jumps_has() {
    let of_universal = SOUND.iter().find(|s| s.kind == Kind::Universal && s.profile == "steady").unwrap();
    let recording = &of_universal.recording;
    let lost = |volts: &dyn Fn(f64) -> f64| {
        let changed = change(recording, Channel::Voltage, |u| (0..u.len()).for_each(|n| u[n] = volts(n as f64 * 1e-4)));
        of(&check(std::slice::from_ref(&changed), Some(Kind::Universal)), Code::SamplesLost).cloned()
    };
    let mains = |t: f64| (std::f64::consts::TAU * 50.0 * t).sin();
    for within in 0..20 {
        let at = 2.0 + f64::from(within) * 1e-3 + 3e-5;
        for ratio in [0.5, 0.88, 0.93, 1.08, 1.7] {
            let found = lost(&|t| if t < at { 150.0 } else { 150.0 * ratio } * mains(t));
            assert!(found.is_none(), "{at} {ratio}: {found:?}");
        }
        // A gap in the samples, whose stamps go on. One of half a period may leave nothing of the period it falls into,
        // and is not told then.
        for gap in [0.5e-3, 3e-3, 17e-3] {
            let found = lost(&|t| 150.0 * mains(if t < at { t } else { t + gap }));
            assert!(found.is_some(), "{at} {gap}");
        }
    }
}

#[test]
fn the_same_recording_twice_is_found() {
    let [a, b] = [&SOUND[0].recording, &SOUND[1].recording];
    assert!(same(a, a) && !same(a, b));
    assert!(same(a, &a.part(0..a.len() / 2)));
    let findings = check(&[a.clone(), b.clone(), a.clone()], Some(Kind::PmDc));
    assert_eq!(findings.iter().filter(|f| f.code == Code::DuplicateRecording).count(), 1);
}

/// Recordings by others, as far as they are there: what may be said about each.
#[test]
fn measured_data_are_told_nothing_false() {
    let folder = std::env::var("GREYRIG_DATA").unwrap_or_else(|_| "../shared/data".into());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
    let maps: [(&str, &[&str], &[Code]); 6] = [
        ("FRA233/step_1.csv", &[], &[]),
        ("FRA233/sine_1.csv", &[], &[]),
        ("HSM150/idf_pos_0.06_1.csv", &["torque_n_m=torque_in_Nm"], &[]),
        ("EMPS/emps_train.csv", &["angle_rad=q_m", "torque_n_m=force_N"], &[]),
        ("EMPS/emps_pulses.csv", &["angle_rad=q_m", "torque_n_m=force_N"], &[]),
        ("CED/ced_prbs.csv", &["u_v=u1", "omega_rad_s=z1"], &[Code::SignLost]),
    ];
    for (name, map, expected) in maps {
        let path = folder.join(name);
        if !path.exists() {
            println!("skipped: no data");
            return;
        }
        let recording = load(&path, &Mapping::parse(map).unwrap(), &Context::quiet()).unwrap();
        let found = check(&[recording], Some(Kind::PmDc));
        let serious = found.iter().filter(|f| f.severity != Severity::Info);
        let codes: Vec<Code> = serious.map(|f| f.code).collect();
        assert_eq!(codes, expected, "{name}: {found:#?}");
    }
}

#[test]
fn the_command_names_the_option_that_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let sound = SOUND.iter().find(|s| s.kind == Kind::PmDc && s.profile == "dc-steps").unwrap();
    let speed = sound.recording.channel(Channel::Speed).unwrap();
    let row = |n: usize| {
        let [u, i] = [Channel::Voltage, Channel::Current].map(|c| sound.recording.channel(c).unwrap()[n]);
        format!("{:.4},{u},{i},{}\n", n as f64 * 1e-4, -speed[n])
    };
    let rows: String = (0..sound.recording.len()).map(row).collect();
    std::fs::write(&path, format!("t_s,u_v,i_a,tacho\n{rows}")).unwrap();
    let file = path.to_str().unwrap();
    let run = |arguments: &[&str]| {
        let out = greyrig(&[arguments, &[file, "--kind", "pm-dc", "--map", "omega_rad_s=tacho"][..]].concat());
        (out.status.code(), String::from_utf8(out.stdout).unwrap() + &String::from_utf8(out.stderr).unwrap())
    };
    let (code, text) = run(&["check", "--json"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains(r#""code":"sign_reversed""#) && text.contains("--map omega_rad_s=tacho*-1"), "{text}");
    let (code, text) = run(&["identify"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("the sign of the speed is reversed") && text.contains("--map omega_rad_s=tacho*-1"),
        "{text}"
    );
    // What goes on from a sound recording reads it in the same way.
    let out = greyrig(&["check", file, "--kind", "pm-dc", "--map", "omega_rad_s=tacho*-1"]);
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(
        text.contains(&format!("identify {file} --map 'omega_rad_s=tacho*-1' --kind pm-dc --out model.toml")),
        "{text}"
    );
    let (code, text) = run(&["diagnose", "--json"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains(r#""kind":"insufficient_data""#) && text.contains("sign_reversed"), "{text}");
    let out = greyrig(&["check", file, "--map", "omega_rad_s=tacho*-1", "--kind", "pm-dc"]);
    let text = String::from_utf8(out.stdout).unwrap();
    assert_eq!(out.status.code(), Some(0), "{text}");
    assert!(text.contains("next: greyrig identify"), "{text}");
}
