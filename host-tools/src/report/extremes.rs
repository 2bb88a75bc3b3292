//! Fewer points without losing a spike: the smallest and the largest of each bucket of samples.

/// A signal in fewer points: two per bucket, its smallest and its largest sample in the order in which they occur.
#[derive(Debug, Clone, PartialEq)]
pub struct Extremes {
    /// Samples from one point to the next: half a bucket, or 1 where nothing had to be left out.
    pub step: f64,
    /// The points; NaN where a bucket has no finite sample.
    pub points: Vec<f32>,
}

/// Samples per bucket so that `samples` become at most `points` points; 1: all samples fit as they are.
fn bucket(samples: usize, points: usize) -> usize {
    if samples <= points { 1 } else { (2 * samples).div_ceil(points.max(2)) }
}

/// Samples from one point to the next after [`extremes`].
pub fn step(samples: usize, points: usize) -> f64 {
    match bucket(samples, points & !1) {
        1 => 1.0,
        width => width as f64 / 2.0,
    }
}

/// Reduces a signal to at most `points` points (two at least). The minimum and the maximum of any run of whole buckets
/// are among the points of these buckets, so that a spike of a single sample stays in sight.
pub fn extremes(signal: &[f64], points: usize) -> Extremes {
    // An odd count would leave half a bucket over.
    let width = bucket(signal.len(), points & !1);
    let step = step(signal.len(), points);
    if width == 1 {
        return Extremes { step, points: signal.iter().map(|&v| v as f32).collect() };
    }
    Extremes { step, points: signal.chunks(width).flat_map(first_and_last_extreme).collect() }
}

fn first_and_last_extreme(bucket: &[f64]) -> [f32; 2] {
    let mut finite = bucket.iter().copied().enumerate().filter(|(_, v)| v.is_finite());
    let Some(first) = finite.next() else { return [f32::NAN; 2] };
    let (mut low, mut high) = (first, first);
    for sample in finite {
        if sample.1 < low.1 {
            low = sample;
        }
        if sample.1 > high.1 {
            high = sample;
        }
    }
    if low.0 <= high.0 { [low.1 as f32, high.1 as f32] } else { [high.1 as f32, low.1 as f32] }
}
