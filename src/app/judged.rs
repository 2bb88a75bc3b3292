//! A judged period as words, for the queue from the interrupt to the thread.

use super::ring::Words;
use crate::detector::{Alarm, Cause, Features, Kind, Period, Verdict};
use crate::link::message::Judged;

/// Words of a judged period: numbers, flags, the alarm's ratio, jumps, features.
pub const WORDS: usize = 18;

const VERDICTS: [Verdict; 3] = [Verdict::CannotJudge, Verdict::Pass, Verdict::Fail];
/// Places in the word of flags.
const JUDGED: u32 = 1;
const ALARM: u32 = 2;
const VERDICT: u32 = 8;
const CAUSE: u32 = 16;
const KIND: u32 = 24;

/// The words before the features.
pub const HEAD: usize = 8;

/// What stands before the features.
#[inline]
pub fn head(numbers: [u32; 4], period: &Period, verdict: Verdict) -> [u32; HEAD] {
    let [test, first, index, sample] = numbers;
    let [k, l] = period.jumps.map(f32::to_bits);
    let verdict = match verdict {
        Verdict::CannotJudge => 0,
        Verdict::Pass => 1,
        Verdict::Fail => 2,
    };
    let mut flags = (u32::from(period.judged) * JUDGED) | (verdict << VERDICT);
    let mut ratio = 0;
    if let Some(alarm) = period.alarm {
        flags |= ALARM | ((alarm.cause as u32) << CAUSE) | ((alarm.kind as u32) << KIND);
        ratio = alarm.ratio.to_bits();
    }
    [test, first, index, sample, flags, ratio, k, l]
}

/// The features.
#[inline]
pub fn features(period: &Period) -> [u32; WORDS - HEAD] {
    period.features.each().map(f32::to_bits)
}

impl Words<WORDS> for Judged {
    fn to_words(&self) -> [u32; WORDS] {
        let Self { test, first, index, sample, period, verdict } = self;
        let [t, f, n, s, flags, ratio, k, l] = head([*test, *first, *index, *sample], period, *verdict);
        let [a, b, c, d, e, g, h, i, j, m] = features(period);
        [t, f, n, s, flags, ratio, k, l, a, b, c, d, e, g, h, i, j, m]
    }

    fn from_words(words: [u32; WORDS]) -> Self {
        let [test, first, index, sample, flags, ratio, k, l, features @ ..] = words;
        let place = |at: u32| ((flags >> at) & 0xFF) as usize;
        let alarm = match (Cause::ALL.get(place(CAUSE)), Kind::ALL.get(place(KIND))) {
            (Some(&cause), Some(&kind)) if flags & ALARM != 0 => {
                Some(Alarm { cause, kind, ratio: f32::from_bits(ratio) })
            }
            _ => None,
        };
        let period = Period {
            features: Features::of(features.map(f32::from_bits)),
            jumps: [k, l].map(f32::from_bits),
            judged: flags & JUDGED != 0,
            alarm,
        };
        let verdict = VERDICTS.get(place(VERDICT)).copied().unwrap_or(Verdict::CannotJudge);
        Self { test, first, index, sample, period, verdict }
    }
}
