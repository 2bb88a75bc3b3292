//! A queue from the interrupt to the thread: of plain words, without locks, without panics, without `unsafe`.
//!
//! One side pushes, the other pops; all words are atomic, so that a second pusher would mix up its values with the
//! first one's but do no other harm. (The queue of heapless divides by its length when it is shared, and keeps a panic
//! for the case that it is zero; the sampling interrupt must have none.)

use core::marker::PhantomData;
use core::sync::atomic::{AtomicU32, Ordering};

/// Something that is so many words.
pub trait Words<const W: usize> {
    /// As words.
    fn to_words(&self) -> [u32; W];
    /// From words.
    fn from_words(words: [u32; W]) -> Self;
}

/// A queue of at most N values of W words each; N is a power of two.
#[derive(Debug)]
pub struct Ring<T, const W: usize, const N: usize> {
    slots: [[AtomicU32; W]; N],
    /// How many were pushed and popped, wrapping.
    pushed: AtomicU32,
    popped: AtomicU32,
    values: PhantomData<fn() -> T>,
}

impl<T: Words<W>, const W: usize, const N: usize> Default for Ring<T, W, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Words<W>, const W: usize, const N: usize> Ring<T, W, N> {
    const MASK: usize = {
        assert!(N.is_power_of_two());
        N - 1
    };

    /// An empty one.
    pub const fn new() -> Self {
        Self {
            slots: [const { [const { AtomicU32::new(0) }; W] }; N],
            pushed: AtomicU32::new(0),
            popped: AtomicU32::new(0),
            values: PhantomData,
        }
    }

    /// How many wait.
    pub fn len(&self) -> usize {
        self.pushed.load(Ordering::Acquire).wrapping_sub(self.popped.load(Ordering::Acquire)) as usize
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a value; says whether there was room.
    #[inline]
    #[must_use]
    pub fn push(&self, value: &T) -> bool {
        let Some(pushed) = self.fill(0, value.to_words()) else { return false };
        self.pushed.store(pushed.wrapping_add(1), Ordering::Release);
        true
    }

    /// Writes some words, from one on, of a value that is to be [added](Ring::add); says whether there is room for it.
    #[inline]
    #[must_use]
    pub fn write<const L: usize>(&self, from: usize, words: [u32; L]) -> bool {
        self.fill(from, words).is_some()
    }

    /// Adds the value that has been written.
    #[inline]
    pub fn add(&self) {
        self.pushed.store(self.pushed.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
    }

    /// As [`Ring::write`]; gives how many were pushed before, if there is room.
    #[inline(always)]
    fn fill<const L: usize>(&self, from: usize, words: [u32; L]) -> Option<u32> {
        let pushed = self.pushed.load(Ordering::Relaxed);
        if pushed.wrapping_sub(self.popped.load(Ordering::Acquire)) as usize >= N {
            return None;
        }
        // The mask spares the panic of an index and never changes the place: N is a power of two.
        let slot = &self.slots[pushed as usize & Self::MASK];
        for (place, word) in slot.iter().skip(from).zip(words) {
            place.store(word, Ordering::Relaxed);
        }
        Some(pushed)
    }

    /// Takes the oldest value.
    #[inline]
    pub fn pop(&self) -> Option<T> {
        let popped = self.popped.load(Ordering::Relaxed);
        if popped == self.pushed.load(Ordering::Acquire) {
            return None;
        }
        let slot = &self.slots[popped as usize & Self::MASK];
        let value = T::from_words(slot.each_ref().map(|word| word.load(Ordering::Relaxed)));
        self.popped.store(popped.wrapping_add(1), Ordering::Release);
        Some(value)
    }
}
