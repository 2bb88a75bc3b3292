//! Exceptions: what is pending, what is active, who comes first (ARMv7-M ARM, sections B1.5 and B3.4).
//!
//! Stacking and return are the [processor](crate::processor)'s. The STM32G474 has four bits of priority (RM0440, NVIC)
//! and 102 interrupts; there are no groups of priorities.

/// Number of the first external interrupt among the exceptions.
pub const EXTERNAL: usize = 16;
/// External interrupts.
pub const INTERRUPTS: usize = 102;
const COUNT: usize = EXTERNAL + INTERRUPTS;

/// Non-maskable interrupt.
pub const NMI: usize = 2;
/// Hard fault.
pub const HARD_FAULT: usize = 3;
/// Supervisor call.
pub const SV_CALL: usize = 11;
/// Pendable request for a service.
pub const PEND_SV: usize = 14;
/// The processor's own timer.
pub const SYS_TICK: usize = 15;

/// Priority of whatever runs when nothing is active.
const THREAD: i16 = 256;

/// A set of exceptions.
type Set = u128;

/// Pending, enabled, active; priorities.
#[derive(Debug, Clone)]
pub struct Exceptions {
    pending: Set,
    enabled: Set,
    active: Set,
    lines: Set,
    priority: [u8; COUNT],
    /// The most urgent that is pending and enabled.
    first: Option<(i16, usize)>,
    /// Priority of what is active.
    running: i16,
}

/// The masks of the processor (ARMv7-M ARM, section B1.4.3).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Masks {
    /// PRIMASK.
    pub primask: bool,
    /// FAULTMASK.
    pub faultmask: bool,
    /// BASEPRI.
    pub basepri: u8,
}

impl Default for Exceptions {
    fn default() -> Self {
        // The system's own exceptions need not be enabled.
        let enabled = (1 << EXTERNAL) - 1;
        Self { pending: 0, enabled, active: 0, lines: 0, priority: [0; COUNT], first: None, running: THREAD }
    }
}

impl Exceptions {
    fn urgency(&self, number: usize) -> i16 {
        match number {
            NMI => -2,
            HARD_FAULT => -1,
            _ => i16::from(self.priority[number]),
        }
    }

    fn refresh(&mut self) {
        let most_urgent = |exceptions: &Self, mut set: Set| {
            let mut first = None;
            while set != 0 {
                let number = set.trailing_zeros() as usize;
                set &= set - 1;
                let urgency = exceptions.urgency(number);
                // The lowest number wins among equals.
                if first.is_none_or(|(best, _)| urgency < best) {
                    first = Some((urgency, number));
                }
            }
            first
        };
        self.first = most_urgent(self, self.pending & self.enabled);
        self.running = most_urgent(self, self.active).map_or(THREAD, |(urgency, _)| urgency);
    }

    /// Whether something is pending that is more urgent than what is active, masks left aside.
    #[inline]
    pub fn knocks(&self) -> bool {
        self.first.is_some_and(|(urgency, _)| urgency < self.running)
    }

    /// What has to be taken now, if anything.
    pub fn due(&self, masks: Masks) -> Option<usize> {
        let (urgency, number) = self.first?;
        let mut running = self.running;
        if masks.basepri != 0 {
            running = running.min(masks.basepri.into());
        }
        if masks.primask {
            running = running.min(0);
        }
        if masks.faultmask {
            running = running.min(-1);
        }
        (urgency < running).then_some(number)
    }

    /// Whether anything is pending and enabled, whatever masks it: this wakes from WFI (ARMv7-M ARM, section B1.5.19).
    pub fn any_pending(&self) -> bool {
        self.first.is_some()
    }

    /// Makes an exception pending.
    pub fn pend(&mut self, number: usize) {
        self.pending |= 1 << number;
        self.refresh();
    }

    /// The level of an external interrupt's line. It becomes pending as the level rises, and again after a return from
    /// the handler if the level is still high.
    pub fn line(&mut self, interrupt: usize, high: bool) {
        let bit: Set = 1 << (EXTERNAL + interrupt);
        if high == (self.lines & bit != 0) {
            return;
        }
        if high {
            self.lines |= bit;
            self.pending |= bit;
            self.refresh();
        } else {
            self.lines &= !bit;
        }
    }

    /// The handler is entered.
    pub fn enter(&mut self, number: usize) {
        self.pending &= !(1 << number);
        self.active |= 1 << number;
        self.refresh();
    }

    /// The handler has returned.
    pub fn leave(&mut self, number: usize) {
        self.active &= !(1 << number);
        self.pending |= self.lines & (1 << number);
        self.refresh();
    }

    /// Reads a register of the NVIC (0xE000E100 …); offsets count from there.
    pub fn read(&self, offset: u32) -> Option<u32> {
        let word = |set: Set| (set >> (EXTERNAL as u32 + 8 * (offset % 0x20))) as u32;
        match offset {
            0x000..0x010 | 0x080..0x090 => Some(word(self.enabled)),
            0x100..0x110 | 0x180..0x190 => Some(word(self.pending)),
            0x200..0x210 => Some(word(self.active)),
            0x300..0x370 => {
                let first = EXTERNAL + (offset - 0x300) as usize;
                let byte = |n: usize| self.priority.get(first + n).copied().unwrap_or(0);
                Some(u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)]))
            }
            _ => None,
        }
    }

    /// Writes a register of the NVIC; priorities may be written in bytes, too.
    pub fn write(&mut self, offset: u32, bytes: usize, value: u32) -> Option<()> {
        let external = ((1 << INTERRUPTS) - 1) << EXTERNAL;
        let bits = (Set::from(value) << (EXTERNAL as u32 + 8 * (offset % 0x20))) & external;
        match (offset, bytes) {
            (0x000..0x010, 4) => self.enabled |= bits,
            (0x080..0x090, 4) => self.enabled &= !bits,
            (0x100..0x110, 4) => self.pending |= bits,
            (0x180..0x190, 4) => self.pending = (self.pending & !bits) | (self.lines & bits),
            (0x300..0x370, _) => self.set_priorities(EXTERNAL + (offset - 0x300) as usize, bytes, value),
            _ => return None,
        }
        self.refresh();
        Some(())
    }

    /// Priorities of exceptions from `first` on, a byte each, of which the upper four bits count.
    pub fn set_priorities(&mut self, first: usize, bytes: usize, value: u32) {
        for (n, byte) in value.to_le_bytes().into_iter().take(bytes).enumerate() {
            if let Some(priority) = self.priority.get_mut(first + n) {
                *priority = byte & 0xF0;
            }
        }
        self.refresh();
    }

    /// Priorities of the four exceptions from `first` on.
    pub fn priorities(&self, first: usize) -> u32 {
        let byte = |n: usize| self.priority.get(first + n).copied().unwrap_or(0);
        u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])
    }

    /// Bits of ICSR (ARMv7-M ARM, section B3.2.4) but VECTACTIVE, which is the processor's.
    pub fn icsr(&self) -> u32 {
        let bit = |number: usize, place: u32| ((self.pending >> number & 1) as u32) << place;
        let vector = self.first.map_or(0, |(_, number)| number as u32);
        let external = u32::from(self.pending >> EXTERNAL != 0);
        bit(NMI, 31) | bit(PEND_SV, 28) | bit(SYS_TICK, 26) | external << 22 | vector << 12
    }

    /// Writes to ICSR.
    pub fn write_icsr(&mut self, value: u32) {
        for (place, number, set) in
            [(31, NMI, true), (28, PEND_SV, true), (27, PEND_SV, false), (26, SYS_TICK, true), (25, SYS_TICK, false)]
        {
            if value >> place & 1 == 1 {
                if set {
                    self.pending |= 1 << number;
                } else {
                    self.pending &= !(1 << number);
                }
            }
        }
        self.refresh();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ADC: usize = EXTERNAL + 18;
    const USART: usize = EXTERNAL + 38;

    fn two() -> Exceptions {
        let mut exceptions = Exceptions::default();
        exceptions.write(0x000, 4, 1 << 18).unwrap();
        exceptions.write(0x004, 4, 1 << (38 - 32)).unwrap();
        exceptions.write(0x300 + 38, 1, 0x80).unwrap();
        exceptions
    }

    /// ARMv7-M ARM, section B1.5.4: a more urgent one interrupts a less urgent one, not the other way round.
    #[test]
    fn the_urgent_interrupts_the_others() {
        let mut exceptions = two();
        exceptions.line(38, true);
        assert_eq!(exceptions.due(Masks::default()), Some(USART));
        exceptions.enter(USART);
        assert_eq!(exceptions.due(Masks::default()), None);
        exceptions.line(18, true);
        assert_eq!(exceptions.due(Masks::default()), Some(ADC));
        exceptions.enter(ADC);
        exceptions.line(18, false);
        exceptions.leave(ADC);
        // The line of the USART is still high: after its return it comes again.
        assert_eq!(exceptions.due(Masks::default()), None);
        exceptions.leave(USART);
        assert_eq!(exceptions.due(Masks::default()), Some(USART));
    }

    #[test]
    fn masks_hold_back_all_but_the_nmi() {
        let mut exceptions = two();
        exceptions.line(18, true);
        assert_eq!(exceptions.due(Masks { primask: true, ..Masks::default() }), None);
        // BASEPRI holds back what is as urgent as itself or less.
        assert_eq!(exceptions.due(Masks { basepri: 0x10, ..Masks::default() }), Some(ADC));
        exceptions.write(0x300 + 18, 1, 0x10).unwrap();
        assert_eq!(exceptions.due(Masks { basepri: 0x10, ..Masks::default() }), None);
        exceptions.pend(NMI);
        assert_eq!(exceptions.due(Masks { primask: true, faultmask: true, basepri: 0x10 }), Some(NMI));
    }
}
