//! The judgement of a period that has ended: a step with each of the next samples, in this order. Where the tick took
//! longer, because the modelled rotor was turned round, the step waits for the next sample, [`MOST_WAITS`] times at
//! most.
//!
//! | steps | what |
//! | --- | --- |
//! | 10 | a feature each |
//! | 1 | whether the period is judged; abrupt changes |
//! | 7 | a cause of an alarm each |
//! | 1 | where the fault sits |
//! | 1 | the period is told |

use super::features::FEATURES;
use super::period::SHORTEST_S;
use super::{
    Alarm, Cause, Cumulative, Fast, Features, Jump, Kind, LEAST_SAMPLE_RATE_HZ, Period, Progress, Settings, Sums,
    Tolerance, Verdict, isolation::locate,
};

/// Steps of a judgement, one with each of the samples after the period's end but those with which it waits.
pub const STEPS: usize = FEATURES + CAUSES + 3;

/// Samples after a period's end, at most, with which a step waits because the tick took longer.
pub const MOST_WAITS: u8 = 4;

const _: () = assert!(
    ((STEPS + MOST_WAITS as usize) as f32) < SHORTEST_S * LEAST_SAMPLE_RATE_HZ,
    "a period is judged before the next one ends"
);

const CAUSES: usize = Cause::ALL.len();

/// Validity of the correction below which a period is not judged.
const LEAST_VALIDITY: f32 = 0.9;

/// What is watched, and the period that is being judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Judge {
    settings: Settings,
    watches: [Fast; 5],
    jumps: [Jump; 2],
    deviations: [Cumulative; 2],
    judged: u32,
    called: bool,
    /// The next step; [`STEPS`]: nothing is to be done.
    step: usize,
    /// How often it has waited.
    waits: u8,
    sums: Sums,
    starting: bool,
    period: Period,
}

impl Judge {
    /// Nothing has been judged.
    pub fn new(settings: Settings) -> Self {
        let l = settings.limits;
        let tolerance = |[centre, half_width]: [f32; 2]| Cumulative::new(Tolerance { centre, half_width });
        Self {
            watches: [l.current, l.speed, l.sparking, l.current_jump, l.speed_jump].map(Fast::new),
            jumps: [Jump::default(); 2],
            deviations: [tolerance(l.current_deviation), tolerance(l.speed_deviation)],
            settings,
            judged: 0,
            called: false,
            step: STEPS,
            waits: 0,
            sums: Sums::default(),
            starting: false,
            period: Period { features: Features::default(), jumps: [0.0; 2], judged: false, alarm: None },
        }
    }

    /// Begins with the sums of a period that has ended; one during the start is not judged.
    #[inline]
    pub fn begin(&mut self, sums: Sums, starting: bool) {
        (self.sums, self.starting, self.step, self.waits) = (sums, starting, 0, 0);
    }

    /// Makes a step, if one is to be made; with a sample that is `busy` not before it has waited [`MOST_WAITS`] times.
    #[inline]
    pub fn step(&mut self, busy: bool) -> Progress {
        if busy && self.waits < MOST_WAITS {
            self.waits += 1;
            return Progress::Step;
        }
        let step = self.step;
        if step == STEPS {
            return Progress::Idle;
        }
        self.step = step + 1;
        if step < FEATURES {
            self.sums.feature(step, &mut self.period.features);
        } else if step == FEATURES {
            self.admit();
        } else if step == STEPS - 2 {
            self.conclude();
        } else if let Some(&cause) = Cause::ALL.get(step - FEATURES - 1) {
            self.watch(cause);
        } else {
            return Progress::Told;
        }
        Progress::Step
    }

    /// The period that was judged last, until the next one is.
    pub fn period(&self) -> &Period {
        &self.period
    }

    /// Whether the period is judged, and what has changed abruptly.
    fn admit(&mut self) {
        let (s, period) = (&self.settings, &mut self.period);
        let f = &period.features;
        let judged = !self.starting
            && f.voltage_rms >= s.least_voltage * s.nominal_voltage
            && f.voltage_rms <= s.most_voltage * s.nominal_voltage
            && f.speed_mean.abs() >= s.least_speed
            && f.validity >= LEAST_VALIDITY;
        let [current, speed] = &mut self.jumps;
        period.jumps = if judged {
            [current.process(f.current_deviation), speed.process(f.speed_deviation)]
        } else {
            current.reset();
            speed.reset();
            [0.0; 2]
        };
        period.judged = judged;
        period.alarm = None;
    }

    /// Lets a cause call; the strongest one is kept.
    fn watch(&mut self, cause: Cause) {
        let Period { features: f, jumps, judged, alarm } = &mut self.period;
        if !*judged {
            return;
        }
        let ratio = match cause {
            Cause::CurrentError => self.watches[0].process(f.current),
            Cause::SpeedError => self.watches[1].process(f.speed),
            Cause::Sparking => self.watches[2].process(f.sparking),
            Cause::CurrentJump => self.watches[3].process(jumps[0].abs()),
            Cause::SpeedJump => self.watches[4].process(jumps[1].abs()),
            Cause::CurrentDeviation => self.deviations[0].process(f.current_deviation).map(f32::abs),
            Cause::SpeedDeviation => self.deviations[1].process(f.speed_deviation).map(f32::abs),
        };
        if let Some(ratio) = ratio
            && alarm.is_none_or(|strongest| ratio > strongest.ratio)
        {
            *alarm = Some(Alarm { cause, kind: Kind::Sensor, ratio });
        }
    }

    /// Counts the period, and says where the fault sits if a cause has called.
    fn conclude(&mut self) {
        let Period { features: f, jumps, judged, alarm } = &mut self.period;
        self.judged += u32::from(*judged);
        let Some(alarm) = alarm else { return };
        self.called = true;
        let [_, _, sparking, current_jump, speed_jump] = self.watches.each_ref().map(Fast::calls);
        alarm.kind = if sparking {
            // Sparks take voltage, which moves current and speed, too, and more.
            alarm.cause = Cause::Sparking;
            alarm.ratio = self.watches[2].ratio(f.sparking);
            Kind::Electrical
        } else if current_jump || speed_jump {
            locate(jumps[0], jumps[1])
        } else {
            let [current, speed] = &self.deviations;
            locate(current.in_tolerances(f.current_deviation), speed.in_tolerances(f.speed_deviation))
        };
    }

    /// The verdict so far; once a motor has failed it stays so.
    pub fn verdict(&self) -> Verdict {
        if self.called {
            Verdict::Fail
        } else if self.judged >= self.settings.fewest_periods {
            Verdict::Pass
        } else {
            Verdict::CannotJudge
        }
    }
}
