//! Random numbers: one seed, a stream of its own for each purpose, so that switching one thing off leaves all others
//! as they were.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// What random numbers are drawn for. The discriminant is the stream's number: never reuse one.
#[derive(Debug, Clone, Copy)]
pub enum Purpose {
    /// Parameters of a unit of the production lot.
    Population = 1,
    /// Turbulence of the load.
    Turbulence = 2,
    /// Fluctuation of the mains.
    Mains = 3,
    /// Which effect is hidden.
    Hidden = 4,
    /// Noise of the voltage channel.
    VoltageNoise = 10,
    /// Noise of the current channel.
    CurrentNoise = 11,
    /// Noise of the speed channel.
    SpeedNoise = 12,
}

/// The source of all streams of one run.
#[derive(Debug, Clone, Copy)]
pub struct Streams {
    seed: u64,
}

impl Streams {
    /// All streams of a seed.
    pub const fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// The stream of a fixed purpose.
    pub fn stream(&self, purpose: Purpose) -> ChaCha8Rng {
        self.numbered(purpose as u64)
    }

    /// The stream of an effect or a fault, told apart by its identifier.
    pub fn named(&self, id: &str) -> ChaCha8Rng {
        // FNV-1a; the top bit keeps it clear of the fixed purposes.
        let hash = id.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
        self.numbered(hash | 1 << 63)
    }

    fn numbered(&self, number: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(number);
        rng
    }
}
