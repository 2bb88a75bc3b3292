//! USART2 (RM0440, section 37): asynchronous, 8 bits without parity, with FIFOs, with requests to the DMA.
//!
//! Bits are whole or not there: the line has no noise and both ends have the same rate.

use std::collections::VecDeque;

use super::{Answer, NEVER, bit};
use crate::fault::Trouble;

const UE: u32 = 0;
const RE: u32 = 2;
const TE: u32 = 3;
const FIFOEN: u32 = 29;
/// Bytes in a FIFO (section 37.5.4).
const FIFO: usize = 8;
/// Start bit, eight data bits, stop bit.
const BITS: u64 = 10;

const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
/// RXNE; RXFNE with FIFOs.
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
/// TXE; TXFNF with FIFOs.
const TXE: u32 = 1 << 7;

/// The transceiver with its line.
#[derive(Debug, Clone)]
pub struct Usart {
    cr: [u32; 3],
    brr: u32,
    presc: u32,
    isr: u32,
    /// RDR and what is behind it.
    received: VecDeque<u8>,
    /// TDR and what is behind it.
    waiting: VecDeque<u8>,
    /// What leaves at present, and when its stop bit ends.
    leaving: Option<(u8, u64)>,
    /// When the stop bit of the next byte from the host ends, if one is on its way.
    arriving: u64,
    /// When the line has been idle for a frame after the last byte.
    idle: u64,
    /// Bytes from the host that have not begun to arrive.
    pub from_host: VecDeque<u8>,
    /// Bytes that have left.
    pub to_host: Vec<u8>,
    /// Bytes that arrived while RDR was full, or while nobody listened.
    lost: u64,
}

impl Default for Usart {
    fn default() -> Self {
        Self {
            cr: [0; 3],
            brr: 0,
            presc: 0,
            isr: TC,
            received: VecDeque::new(),
            waiting: VecDeque::new(),
            leaving: None,
            arriving: NEVER,
            idle: NEVER,
            from_host: VecDeque::new(),
            to_host: Vec::new(),
            lost: 0,
        }
    }
}

impl Usart {
    /// After a reset, with the line as it is: what the host has sent is still on its way.
    pub fn reset(self) -> Self {
        Self { from_host: self.from_host, to_host: self.to_host, lost: self.lost, ..Self::default() }
    }

    fn listens(&self) -> bool {
        bit(self.cr[0], UE) && bit(self.cr[0], RE)
    }

    fn sends(&self) -> bool {
        bit(self.cr[0], UE) && bit(self.cr[0], TE)
    }

    /// Cycles of a byte on the line (section 37.5.8).
    fn byte(&self) -> u64 {
        BITS * u64::from(self.brr)
    }

    /// Rate of the line, bits per second; none before it is set.
    pub fn baud(&self, clock_hz: u32) -> Option<u32> {
        (self.brr > 0).then(|| clock_hz / self.brr)
    }

    /// When a byte has left or arrived.
    pub fn next(&self) -> u64 {
        self.leaving.map_or(NEVER, |(_, at)| at).min(self.arriving).min(self.idle)
    }

    /// Something may begin to arrive.
    pub fn look_at_line(&mut self, now: u64) {
        if self.arriving == NEVER && self.listens() && !self.from_host.is_empty() {
            self.arriving = now + self.byte();
            self.idle = NEVER;
        }
    }

    /// Time has passed.
    pub fn advance(&mut self, now: u64) {
        if let Some((byte, at)) = self.leaving
            && now >= at
        {
            self.to_host.push(byte);
            self.leaving = None;
            match self.waiting.pop_front() {
                Some(next) => self.leaving = Some((next, at + self.byte())),
                None => self.isr |= TC,
            }
        }
        if now >= self.arriving {
            let at = self.arriving;
            self.arriving = NEVER;
            if let Some(byte) = self.from_host.pop_front() {
                if self.received.len() < self.room() {
                    self.received.push_back(byte);
                } else {
                    self.isr |= ORE;
                    self.lost += 1;
                }
            }
            if self.from_host.is_empty() {
                self.idle = at + self.byte();
            } else {
                self.arriving = at + self.byte();
            }
        }
        if now >= self.idle {
            self.idle = NEVER;
            self.isr |= IDLE;
        }
    }

    /// Whether it asks the DMA to take a received byte.
    pub fn wants_read(&self) -> bool {
        bit(self.cr[2], 6) && !self.received.is_empty()
    }

    /// Whether it asks the DMA for a byte to send.
    pub fn wants_write(&self) -> bool {
        bit(self.cr[2], 7) && self.sends() && self.waiting.len() < self.room()
    }

    fn room(&self) -> usize {
        if bit(self.cr[0], FIFOEN) { FIFO } else { 1 }
    }

    /// ISR; TXFE (23) and RXFF (24) with FIFOs; TEACK (21) and REACK (22) follow TE and RE.
    fn flags(&self) -> u32 {
        let fifos = bit(self.cr[0], FIFOEN);
        let flag = |set: bool, place: u32| u32::from(set) << place;
        self.isr
            | if self.received.is_empty() { 0 } else { RXNE }
            | if self.waiting.len() < self.room() { TXE } else { 0 }
            | flag(self.sends(), 21)
            | flag(self.listens(), 22)
            | flag(fifos && self.waiting.is_empty(), 23)
            | flag(fifos && self.received.len() == FIFO, 24)
    }

    /// Reads RDR.
    pub fn take(&mut self) -> u8 {
        self.received.pop_front().unwrap_or_default()
    }

    /// TDR.
    pub fn put(&mut self, byte: u8, now: u64) {
        if self.leaving.is_none() && self.sends() {
            self.leaving = Some((byte, now + self.byte()));
        } else {
            self.waiting.push_back(byte);
        }
        self.isr &= !TC;
    }

    /// Whether its interrupt's line is high.
    pub fn interrupts(&self) -> bool {
        let [cr1, _, cr3] = self.cr;
        // IDLEIE 4, RXNEIE 5, TCIE 6, TXEIE 7 stand where their flags do; EIE is for overruns with the DMA.
        self.flags() & cr1 & 0xF0 != 0 || (self.isr & ORE != 0 && (bit(cr1, 5) || bit(cr3, 0)))
    }

    /// Bytes that the receiver has lost.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&mut self, offset: u32) -> Answer<u32> {
        Ok(match offset {
            0x00..=0x08 => self.cr[offset as usize / 4],
            0x0C => self.brr,
            0x1C => self.flags(),
            0x24 => self.take().into(),
            0x2C => self.presc,
            _ => return Err(Trouble::Register),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, a mode that is not.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Answer<()> {
        let mode = |allowed: u32| {
            if value & !allowed == 0 {
                Ok(())
            } else {
                Err(Trouble::used(format!("{value:#x} asks for a mode that is not modelled")))
            }
        };
        match offset {
            0x00 => {
                // UE, RE, TE, IDLEIE, RXNEIE, TCIE, TXEIE, PEIE, FIFOEN.
                mode(0b1_1111_1101 | 1 << FIFOEN)?;
                self.cr[0] = value;
            }
            0x04 => {
                mode(0)?;
                self.cr[1] = value;
            }
            0x08 => {
                // EIE, DMAR, DMAT.
                mode(1 | 1 << 6 | 1 << 7)?;
                self.cr[2] = value;
            }
            0x0C if bit(self.cr[0], UE) => return Err(Trouble::used("BRR is written while the USART is on")),
            0x0C => self.brr = value & 0xFFFF,
            // RQR: RXFRQ drops what was received.
            0x18 => {
                if bit(value, 3) {
                    self.received.clear();
                }
            }
            0x20 => self.isr &= !(value & (ORE | IDLE | TC)),
            0x28 => self.put(value as u8, now),
            0x2C => {
                mode(0)?;
                self.presc = value;
            }
            _ => return Err(Trouble::Register),
        }
        self.look_at_line(now);
        Ok(())
    }
}
