//! The kinds of damage, each with the finding that it deserves.

use greyrig::effects::EffectId;
use greyrig_host::model::Kind as MotorKind;
use greyrig_host::recording::finding::Code;
use greyrig_host::recording::{Channel, Recording};
use greyrig_host::rig::{Motor, PROFILES, Setup, logger};

use super::damage::{self, each, largest, of, times};
use super::{Random, Sound};

/// What was made of a sound recording.
pub struct Damaged {
    /// What is checked.
    pub recordings: Vec<Recording>,
    /// Channels that may be named; none: any.
    pub channels: Option<Vec<Channel>>,
    /// The damage, with its size.
    pub what: String,
}

/// A kind of damage.
pub struct Kind {
    /// Its name, without `rig-`.
    pub name: &'static str,
    /// Findings that name it.
    pub codes: &'static [Code],
    /// Findings that are true besides.
    pub besides: &'static [Code],
    /// Effects of the measuring chain that it is.
    pub effects: &'static [EffectId],
    /// The kind of motor that it is taken for.
    pub taken_for: fn(MotorKind) -> MotorKind,
    /// Profiles on which it can be seen.
    pub shows: fn(MotorKind, &str) -> bool,
    /// Does it; none where it cannot be seen on this recording.
    pub damage: fn(&Sound, &mut Random) -> Option<Damaged>,
}

impl Kind {
    /// Whether it is meant by `rig-NAME`, or by a `*` at the end of its beginning.
    pub fn is_asked(&self, name: &str) -> bool {
        let own = format!("rig-{}", self.name);
        name.strip_suffix('*').map_or(own == name, |beginning| own.starts_with(beginning))
    }
}

const fn kind(name: &'static str, codes: &'static [Code], damage: fn(&Sound, &mut Random) -> Option<Damaged>) -> Kind {
    Kind { name, codes, besides: &[], effects: &[], taken_for: itself, shows: driven, damage }
}

fn itself(motor: MotorKind) -> MotorKind {
    motor
}

fn the_other(motor: MotorKind) -> MotorKind {
    match motor {
        MotorKind::PmDc => MotorKind::Universal,
        MotorKind::Universal => MotorKind::PmDc,
    }
}

/// The motor turns under more than one voltage.
fn driven(_: MotorKind, profile: &str) -> bool {
    !["locked", "start", "coast-down", "steady"].contains(&profile)
}

fn magnet(motor: MotorKind, profile: &str) -> bool {
    motor == MotorKind::PmDc && driven(motor, profile)
}

fn alternating(motor: MotorKind, profile: &str) -> bool {
    motor == MotorKind::Universal && ["staircase", "ramp", "steady"].contains(&profile)
}

fn any(_: MotorKind, _: &str) -> bool {
    true
}

const U: Channel = Channel::Voltage;
const I: Channel = Channel::Current;
const W: Channel = Channel::Speed;

fn one(run: Recording, channel: Channel, what: impl Into<String>) -> Option<Damaged> {
    Some(Damaged { recordings: vec![run], channels: Some(vec![channel]), what: what.into() })
}

fn whole(run: Recording, what: impl Into<String>) -> Option<Damaged> {
    Some(Damaged { recordings: vec![run], channels: None, what: what.into() })
}

/// What was read of a file; nothing where it is refused.
fn read(run: greyrig_host::error::Result<Recording>, what: String) -> Option<Damaged> {
    Some(match run {
        Ok(run) => Damaged { recordings: vec![run], channels: None, what },
        Err(error) => Damaged { recordings: Vec::new(), channels: None, what: format!("{what}: {error}") },
    })
}

/// All kinds.
pub const KINDS: &[Kind] = &[
    Kind { shows: any, ..kind("sound", &[], |s, _| whole(s.recording.clone(), "")) },
    kind("sign-u", &[Code::SignReversed], |s, _| {
        // A universal motor does not tell the sign of the voltage from that of the current.
        let channels = if s.motor == MotorKind::PmDc { vec![U] } else { vec![U, I] };
        Some(Damaged { recordings: vec![times(&s.recording, U, -1.0)], channels: Some(channels), what: String::new() })
    }),
    kind("sign-i", &[Code::SignReversed], |s, _| {
        let channels = if s.motor == MotorKind::PmDc { vec![I] } else { vec![U, I] };
        Some(Damaged { recordings: vec![times(&s.recording, I, -1.0)], channels: Some(channels), what: String::new() })
    }),
    kind("sign-w", &[Code::SignReversed], |s, _| one(times(&s.recording, W, -1.0), W, "")),
    kind("swapped", &[Code::ChannelsSwapped], |s, _| {
        let mut run = s.recording.clone();
        run.set_channel(U, of(&s.recording, I).to_vec()).ok()?;
        run.set_channel(I, of(&s.recording, U).to_vec()).ok()?;
        whole(run, "")
    }),
    kind("dead-u", &[Code::ChannelDead], |s, random| {
        let noise = random.between(0.0, 2.0) * damage::noise(of(&s.recording, U));
        one(each(&s.recording, U, |_, _| noise * random.gaussian()), U, "")
    }),
    kind("dead-i", &[Code::ChannelDead], |s, random| {
        let noise = random.between(0.0, 2.0) * damage::noise(of(&s.recording, I));
        one(each(&s.recording, I, |_, _| noise * random.gaussian()), I, "")
    }),
    Kind {
        // With a slow voltage alone, current and voltage go together as those of a large resistance.
        codes: &[Code::ChannelDead, Code::Standstill],
        ..kind("dead-w", &[], |s, random| {
            let noise = random.between(0.0, 2.0) * damage::noise(of(&s.recording, W));
            one(each(&s.recording, W, |_, _| noise * random.gaussian()), W, "")
        })
    },
    kind("supply-u", &[Code::SupplyVoltage], |s, random| {
        if s.motor == MotorKind::Universal {
            return None;
        }
        let level = random.between(1.1, 2.0) * largest(of(&s.recording, U));
        let noise = random.log_between(1e-4, 1e-2) * level;
        let sag = random.between(0.0, 0.05) * level / largest(of(&s.recording, I));
        let i = of(&s.recording, I).to_vec();
        one(each(&s.recording, U, |n, _| level - sag * i[n].abs() + noise * random.gaussian()), U, "")
    }),
    Kind {
        shows: |motor, profile| motor == MotorKind::PmDc && profile == "dc-steps",
        ..kind("commanded-u", &[Code::CommandedVoltage], |s, _| {
            let peak = largest(of(&s.recording, U));
            let mut last = 0.0;
            let exact = |_: usize, x: f64| {
                let level = (x / peak * 20.0).round() / 20.0 * peak;
                if (x - last).abs() > 0.03 * peak {
                    last = level;
                }
                last
            };
            one(each(&s.recording, U, exact), U, "")
        })
    },
    Kind {
        codes: &[Code::ScaleSuspect, Code::UnitSuspect],
        ..kind("milli-u", &[], |s, _| one(times(&s.recording, U, 1e3), U, ""))
    },
    Kind {
        codes: &[Code::ScaleSuspect, Code::UnitSuspect],
        ..kind("milli-i", &[], |s, _| one(times(&s.recording, I, 1e3), I, ""))
    },
    Kind {
        codes: &[Code::UnitSuspect],
        ..kind("rpm-with-angle", &[], |s, random| {
            let (name, factor) = random.one_of(&[("rpm", 9.549_296_6), ("deg/s", 57.295_78)]);
            let angle = logger::angle(of(&s.recording, W), s.recording.sample_time_s());
            let mut run = times(&s.recording, W, factor);
            run.set_channel(Channel::Angle, angle).ok()?;
            one(run, W, name)
        })
    },
    Kind {
        codes: &[Code::ScaleSuspect, Code::UnitSuspect],
        ..kind("deg-s", &[], |s, _| one(times(&s.recording, W, 57.295_78), W, ""))
    },
    Kind {
        shows: alternating,
        besides: &[Code::OneSided, Code::SlowSampling],
        ..kind("rms", &[Code::RmsValues], |s, _| {
            let period = (0.02 / s.recording.sample_time_s()).round() as usize;
            let effective = |x: &mut Vec<f64>| *x = damage::rms_of_last(x, period);
            whole(damage::change(&damage::change(&s.recording, U, effective), I, effective), "")
        })
    },
    kind("speed-of-another", &[Code::DifferentMotors], |s, random| {
        let lot = Motor::sample_from_population(&Motor::nominal(s.motor), 0.1, s.seed + 1);
        let profiles: Vec<&str> = ["dc-steps", "dc-ramp", "phase-angle", "ramp", "staircase"]
            .into_iter()
            .filter(|p| {
                *p != s.profile && PROFILES.iter().any(|q| q.id == *p && (q.pm_dc || s.motor == MotorKind::Universal))
            })
            .collect();
        let setup = Setup::new(s.motor).motor(lot).profile(random.one_of(&profiles)).ok()?.seconds(7.0);
        let other = setup.seed(s.seed + 1).run().ok()?.recording;
        let every = (s.recording.sample_time_s() / other.sample_time_s()).round() as usize;
        let other = logger::one_of(&other, every).expect("samples are left");
        let factor = largest(of(&s.recording, W)) / largest(of(&other, W));
        let w = of(&other, W);
        one(each(&s.recording, W, |n, _| factor * w[n.min(w.len() - 1)]), W, "")
            .map(|damaged| Damaged { channels: None, ..damaged })
    }),
    kind("time-ms", &[Code::TimeUnit], |s, random| {
        let (name, factor) = random.one_of(&[("ms", 1e3), ("us", 1e6)]);
        let run = damage::rebuilt(&s.recording, s.recording.sample_time_s() * factor, <[f64]>::to_vec);
        whole(run, name)
    }),
    Kind {
        shows: any,
        ..kind("jitter", &[Code::TimeJitter], |s, random| {
            // The samples are taken at scattered instants; the stamps tell them.
            let h = s.recording.sample_time_s();
            let share = random.between(0.2, 0.8);
            let late: Vec<f64> = of(&s.recording, U).iter().map(|_| share * (random.between(0.0, 1.0) - 0.5)).collect();
            let moved = damage::rebuilt(&s.recording, h, |x| {
                if x.is_empty() {
                    Vec::new()
                } else {
                    (0..x.len()).map(|n| damage::at(x, n as f64 + late[n])).collect()
                }
            });
            let stamps: Vec<f64> = late.iter().enumerate().map(|(n, late)| (n as f64 + late + 1.0) * h).collect();
            read(damage::through_text(&moved, &stamps, &format!("jitter-{}.csv", s.seed)), format!("{share:.2}"))
        })
    },
    Kind {
        shows: any,
        ..kind("gap", &[Code::TimeGap], |s, random| {
            let h = s.recording.sample_time_s();
            let length = of(&s.recording, U).len();
            let mut keep = vec![true; length];
            for _ in 0..1 + random.below(3) {
                let gap = (random.log_between(0.005, 0.3) / h).ceil() as usize;
                let from = length / 10 + random.below(length * 8 / 10);
                keep[from..(from + gap).min(length - length / 20)].fill(false);
            }
            let stamps: Vec<f64> = (0..length).filter(|n| keep[*n]).map(|n| n as f64 * h).collect();
            let kept = damage::kept(&s.recording, &keep);
            read(damage::through_text(&kept, &stamps, &format!("gap-{}.csv", s.seed)), String::new())
        })
    },
    Kind {
        ..kind("lost", &[Code::SamplesLost], |s, random| {
            let h = s.recording.sample_time_s();
            let length = of(&s.recording, U).len();
            let mut keep = vec![true; length];
            for _ in 0..3 + random.below(6) {
                let gap = (random.log_between(0.003, 0.05) / h).ceil() as usize;
                let from = length / 10 + random.below(length * 8 / 10);
                keep[from..(from + gap).min(length)].fill(false);
            }
            // What is lost while nothing moves nobody sees.
            let w = of(&s.recording, W);
            let noise = damage::noise(w).max(1e-3 * largest(w));
            let seen = (1..length).any(|n| {
                !keep[n] && keep[n - 1] && {
                    let back = (n..length).find(|m| keep[*m]).unwrap_or(length - 1);
                    (w[back] - w[n - 1]).abs() > 20.0 * noise
                }
            });
            if seen || s.motor == MotorKind::Universal { whole(damage::kept(&s.recording, &keep), "") } else { None }
        })
    },
    kind("clock-skew", &[Code::ClockSkew], |s, random| {
        let skew = random.sign() * random.log_between(1e-3, 1e-2);
        let channel = random.one_of(&[I, W]);
        let x = of(&s.recording, channel).to_vec();
        one(each(&s.recording, channel, |n, _| damage::at(&x, n as f64 * (1.0 + skew))), channel, format!("{skew:.1e}"))
            .map(|damaged| Damaged { channels: None, ..damaged })
    }),
    kind("shift", &[Code::ChannelShift], |s, random| {
        let shift_s = random.sign() * random.log_between(5e-3, 0.1);
        let shift = shift_s / s.recording.sample_time_s();
        let channel = random.one_of(&[I, W]);
        let x = of(&s.recording, channel).to_vec();
        one(each(&s.recording, channel, |n, _| damage::at(&x, n as f64 - shift)), channel, format!("{shift_s:.1e} s"))
            .map(|damaged| Damaged { channels: None, ..damaged })
    }),
    kind("resampled", &[Code::Resampled], |s, random| {
        let factor = random.between(1.3, 4.7);
        let length = of(&s.recording, U).len();
        let longer = damage::rebuilt(&s.recording, s.recording.sample_time_s() / factor, |x| {
            if x.is_empty() {
                return Vec::new();
            }
            (0..(length as f64 * factor) as usize).map(|n| damage::at(x, n as f64 / factor)).collect()
        });
        whole(longer, format!("{factor:.2}"))
    }),
    Kind {
        codes: &[Code::Clipped],
        ..kind("clipped-i", &[], |s, random| {
            let limit = random.between(0.4, 0.8) * largest(of(&s.recording, I));
            let beyond = of(&s.recording, I).iter().filter(|i| i.abs() > limit).count();
            if beyond < 50 {
                return None;
            }
            one(each(&s.recording, I, |_, x| x.clamp(-limit, limit)), I, format!("{beyond} samples"))
        })
    },
    Kind {
        codes: &[Code::Clipped],
        ..kind("clipped-w", &[], |s, random| {
            let limit = random.between(0.5, 0.9) * largest(of(&s.recording, W));
            let beyond = of(&s.recording, W).iter().filter(|i| i.abs() > limit).count();
            if beyond < 50 {
                return None;
            }
            one(each(&s.recording, W, |_, x| x.clamp(-limit, limit)), W, format!("{beyond} samples"))
        })
    },
    Kind {
        shows: |motor, profile| motor == MotorKind::Universal && driven(motor, profile),
        codes: &[Code::OneSided, Code::Clipped],
        ..kind("unipolar-w", &[], |s, _| {
            let cut = of(&s.recording, W).iter().filter(|w| **w < 0.0).count();
            (cut > 200).then(|| one(each(&s.recording, W, |_, x| x.max(0.0)), W, "")).flatten()
        })
    },
    kind("overrange", &[Code::Overrange], |s, random| {
        let code = random.one_of(&[9.9e37, -9.9e37, 1e30]);
        let channel = random.one_of(&[U, I, W]);
        let length = of(&s.recording, channel).len();
        let bad: Vec<usize> = (0..3).map(|_| random.below(length)).collect();
        one(each(&s.recording, channel, |n, x| if bad.contains(&n) { code } else { x }), channel, format!("{code}"))
    }),
    kind("spikes", &[Code::Outliers], |s, random| {
        let channel = random.one_of(&[U, I, W]);
        let x = of(&s.recording, channel);
        let share = random.log_between(1e-4, 2e-3);
        let count = ((share * x.len() as f64) as usize).max(3);
        let height = (0.3 * largest(x)).max(40.0 * damage::noise(x));
        let bad: Vec<(usize, f64)> = (0..count)
            .map(|_| (10 + random.below(x.len() - 20), random.sign() * height * random.between(1.0, 4.0)))
            .collect();
        let spiked = each(&s.recording, channel, |n, x| x + bad.iter().find(|b| b.0 == n).map_or(0.0, |b| b.1));
        one(spiked, channel, format!("{count}"))
    }),
    kind("stuck", &[Code::StuckBits], |s, random| {
        let channel = random.one_of(&[I, W]);
        let x = of(&s.recording, channel);
        let step = 2.2 * largest(x) / 4096.0;
        let bit = 3 + random.below(4);
        let set = random.chance(0.5);
        let convert = |_: usize, x: f64| {
            let code = ((x / step).round() + 2048.0) as i64;
            let code = if set { code | 1 << bit } else { code & !(1 << bit) };
            (code - 2048) as f64 * step
        };
        one(each(&s.recording, channel, convert), channel, format!("bit {bit} {set}"))
    }),
    kind("coarse", &[Code::CoarseSteps, Code::EncoderCounts], |s, random| {
        let channel = random.one_of(&[I, W]);
        let x = of(&s.recording, channel);
        let step = (largest(x) / random.log_between(20.0, 100.0)).max(4.0 * damage::noise(x));
        one(
            each(&s.recording, channel, |_, x| (x / step).round() * step),
            channel,
            format!("{:.0} steps", largest(x) / step),
        )
    }),
    kind("counts", &[Code::EncoderCounts], |s, random| {
        let h = s.recording.sample_time_s();
        let window = ((random.log_between(2e-3, 20e-3) / h) as usize).max(1);
        let w = of(&s.recording, W);
        let pulses = [12.0, 60.0, 120.0, 360.0, 500.0, 1024.0]
            .into_iter()
            .filter(|p| {
                let most = largest(w) * window as f64 * h * p / std::f64::consts::TAU;
                (10.0..400.0).contains(&most)
            })
            .collect::<Vec<f64>>();
        if pulses.is_empty() {
            return None;
        }
        let pulses = random.one_of(&pulses);
        let run = damage::change(&s.recording, W, |x| *x = logger::counted(x, h, pulses as u32, window));
        one(run, W, format!("{pulses} a turn in {window}"))
    }),
    kind("period", &[Code::PulsePeriod], |s, random| {
        let h = s.recording.sample_time_s();
        let w = of(&s.recording, W);
        let mean = w.iter().map(|w| w.abs()).sum::<f64>() / w.len() as f64;
        // Pulses that are some samples apart, and at least some hundred in all.
        let pulses = [1u32, 2, 4, 12, 24, 60]
            .into_iter()
            .filter(|p| {
                let apart = std::f64::consts::TAU / (f64::from(*p) * mean * h);
                (3.0..100.0).contains(&apart) && w.len() as f64 / apart > 100.0
            })
            .collect::<Vec<u32>>();
        if pulses.is_empty() {
            return None;
        }
        let pulses = random.one_of(&pulses);
        let run = damage::change(&s.recording, W, |x| *x = logger::timed(x, h, pulses));
        one(run, W, format!("{pulses} a turn"))
    }),
    kind("held", &[Code::HeldValues], |s, random| {
        let rows = 2 + random.below(19);
        let channel = random.one_of(&[I, W]);
        let x = of(&s.recording, channel).to_vec();
        one(each(&s.recording, channel, |n, _| x[n / rows * rows]), channel, format!("{rows} rows"))
    }),
    kind("averaged", &[Code::MovingAverage], |s, random| {
        let window = 4 + random.below(60);
        let channel = random.one_of(&[I, W]);
        one(
            damage::change(&s.recording, channel, |x| *x = damage::mean_of_last(x, window)),
            channel,
            format!("{window}"),
        )
    }),
    kind("silent", &[Code::SilentBelow], |s, random| {
        let w = of(&s.recording, W);
        let least = random.between(0.05, 0.2) * largest(w);
        let silent = |n: usize| w[n].abs() < least;
        let below = (0..w.len()).filter(|n| silent(*n) && w[*n].abs() > 0.02 * largest(w)).count();
        let edges = (1..w.len()).filter(|n| silent(*n) != silent(n - 1)).count();
        if below < 40 || edges < 2 || below * 20 < w.len() {
            return None;
        }
        one(
            each(&s.recording, W, |_, x| if x.abs() < least { 0.0 } else { x }),
            W,
            format!("{:.2}", least / largest(w)),
        )
    }),
    Kind {
        shows: magnet,
        ..kind("magnitude", &[Code::SignLost], |s, _| {
            let w = of(&s.recording, W);
            let backwards = w.iter().filter(|w| **w < -0.1 * largest(of(&s.recording, W))).count();
            (backwards * 10 > w.len()).then(|| one(each(&s.recording, W, |_, x| x.abs()), W, "")).flatten()
        })
    },
    Kind {
        shows: magnet,
        ..kind("hum", &[Code::Hum], |s, random| {
            let channel = random.one_of(&[I, W]);
            let x = of(&s.recording, channel);
            let hz = random.one_of(&[50.0, 60.0]) * random.one_of(&[1.0, 2.0]);
            let height = random.log_between(0.02, 0.1) * damage::rms(x);
            let phase = random.between(0.0, std::f64::consts::TAU);
            let step = std::f64::consts::TAU * hz * s.recording.sample_time_s();
            one(
                each(&s.recording, channel, |n, x| x + height * (step * n as f64 + phase).sin()),
                channel,
                format!("{hz} Hz"),
            )
        })
    },
    Kind {
        codes: &[Code::Drift, Code::OffsetAtRest],
        effects: &[EffectId::CurrentOffset],
        shows: |_, profile| profile == "coast-down",
        ..kind("drift", &[], |s, random| {
            let x = of(&s.recording, I);
            let length = x.len() as f64;
            let most = random.sign() * random.log_between(0.05, 0.3) * largest(x);
            one(each(&s.recording, I, |n, x| x + most * n as f64 / length), I, format!("{most:.2}"))
        })
    },
    Kind {
        effects: &[EffectId::CurrentOffset],
        shows: |_, profile| ["coast-down", "dc-steps", "staircase", "ramp"].contains(&profile),
        ..kind("offset", &[Code::OffsetAtRest], |s, random| {
            let x = of(&s.recording, I);
            let most = random.sign() * random.log_between(0.02, 0.2) * largest(x);
            // Rest has to be there to be seen.
            let (u, w) = (of(&s.recording, U), of(&s.recording, W));
            let length = (0.3 / s.recording.sample_time_s()) as usize;
            let still = |n: usize| u[n].abs() < 0.02 * largest(u) && w[n].abs() < 0.02 * largest(w);
            let (mut run, mut longest) = (0, 0);
            for n in 0..x.len() {
                run = if still(n) { run + 1 } else { 0 };
                longest = longest.max(run);
            }
            (longest > length).then(|| one(each(&s.recording, I, |_, x| x + most), I, "")).flatten()
        })
    },
    kind("pink", &[Code::ColouredNoise], |s, random| {
        let channel = random.one_of(&[I, W]);
        let x = of(&s.recording, channel);
        let height = (random.log_between(0.01, 0.05) * damage::rms(x)).max(3.0 * damage::noise(x));
        let noise = damage::pink(x.len(), random);
        one(each(&s.recording, channel, |n, x| x + height * noise[n]), channel, "")
    }),
    Kind {
        codes: &[Code::Standstill, Code::ChannelDead],
        shows: |_, profile| profile == "locked",
        ..kind("standstill", &[], |s, _| {
            let builder = Recording::builder(s.recording.sample_time_s());
            let builder = s.recording.channels().iter().fold(builder, |b, (c, x)| b.channel(*c, x.clone()));
            whole(builder.build().ok()?, "")
        })
    },
    Kind {
        besides: &[Code::Standstill],
        ..kind("no-current", &[Code::NoCurrent, Code::ChannelDead], |s, random| {
            let [ni, nw] = [I, W].map(|c| damage::noise(of(&s.recording, c)));
            let still = each(&s.recording, I, |_, _| ni * random.gaussian());
            whole(each(&still, W, |_, _| nw * random.gaussian()), "")
        })
    },
    kind("short", &[Code::TooShort], |s, random| whole(s.recording.part(0..20 + random.below(29)), "")),
    Kind { taken_for: the_other, ..kind("wrong-kind", &[Code::WrongKind], |s, _| whole(s.recording.clone(), "")) },
    kind("another-motor", &[Code::DifferentMotors], |s, random| {
        let factor = random.one_of(&[0.2, 0.4, 2.5, 5.0]);
        let other = times(&s.recording, W, factor).named("other.csv");
        Some(Damaged { recordings: vec![s.recording.clone(), other], channels: None, what: format!("{factor}") })
    }),
    Kind {
        shows: any,
        ..kind("twice", &[Code::DuplicateRecording], |s, _| {
            let again = s.recording.clone().named("again.csv");
            Some(Damaged { recordings: vec![s.recording.clone(), again], channels: None, what: String::new() })
        })
    },
];
