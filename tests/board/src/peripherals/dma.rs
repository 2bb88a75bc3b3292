//! DMA1 with the request multiplexer (RM0440, sections 12 and 13), for USART2: bytes, between memory and its data
//! registers.

use super::{Answer, bit};
use crate::fault::Trouble;

/// Requests of the multiplexer (section 13.3.2).
pub const USART2_RX: u32 = 26;
/// See [`USART2_RX`].
pub const USART2_TX: u32 = 27;

/// Offset of the multiplexer's registers from the controller's.
pub const MULTIPLEXER: u32 = 0x800;

const CHANNELS: usize = 8;
const TCIF: u32 = 1 << 1;
const HTIF: u32 = 1 << 2;

/// A channel.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    ccr: u32,
    count: u32,
    peripheral: u32,
    memory: u32,
    /// Transfers as CNDTR was written, and those done.
    all: u32,
    done: u32,
    /// CCR of the multiplexer.
    request: u32,
}

/// A byte that a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transfer {
    /// Address in memory.
    pub memory: u32,
    /// Which channel.
    channel: usize,
}

/// The controller.
#[derive(Debug, Clone, Default)]
pub struct Dma {
    channels: [Channel; CHANNELS],
    isr: u32,
}

impl Dma {
    /// The next transfer of the channel that serves a request, if one does.
    pub fn serve(&self, request: u32) -> Option<Transfer> {
        let channel = self.channels.iter().position(|c| bit(c.ccr, 0) && c.request & 0x7F == request && c.count > 0)?;
        let Channel { memory, ccr, done, .. } = self.channels[channel];
        Some(Transfer { memory: if bit(ccr, 7) { memory + done } else { memory }, channel })
    }

    /// A transfer has been done.
    pub fn complete(&mut self, transfer: Transfer) {
        let n = transfer.channel;
        let channel = &mut self.channels[n];
        channel.done += 1;
        channel.count -= 1;
        if channel.done == channel.all / 2 {
            self.isr |= (HTIF | 1) << (4 * n);
        }
        if channel.count == 0 {
            self.isr |= (TCIF | 1) << (4 * n);
            if bit(channel.ccr, 5) {
                channel.count = channel.all;
                channel.done = 0;
            }
        }
    }

    /// Whether a channel's interrupt's line is high.
    pub fn interrupts(&self, channel: usize) -> bool {
        // TCIE, HTIE and TEIE stand where their flags do.
        self.isr >> (4 * channel) & self.channels[channel].ccr & 0xE != 0
    }

    /// Reads a register of the controller (below 0x400) or of the multiplexer (from 0x800 on).
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        if offset == 0 {
            return Ok(self.isr);
        }
        let (n, register) = place(offset)?;
        let channel = &self.channels[n];
        Ok(match register {
            Register::Control => channel.ccr,
            Register::Count => channel.count,
            Register::Peripheral => channel.peripheral,
            Register::Memory => channel.memory,
            Register::Request => channel.request,
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, a mode that is not.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        if offset == 4 {
            // A global flag (bit 0 of four) clears all of its channel.
            let whole = (value & 0x1111_1111) * 0xF;
            self.isr &= !(value | whole);
            return Ok(());
        }
        let (n, register) = place(offset)?;
        let channel = &mut self.channels[n];
        if bit(channel.ccr, 0) && matches!(register, Register::Count | Register::Peripheral | Register::Memory) {
            return Err(Trouble::used(format!("channel {} is set up while it is on", n + 1)));
        }
        match register {
            Register::Control => {
                // EN, TCIE, HTIE, TEIE, DIR, CIRC, MINC, PL: sizes of a byte.
                if bit(value, 0) && value & !(0xBF | 3 << 12) != 0 {
                    return Err(Trouble::used(format!(
                        "channel {}: {value:#x} asks for a mode that is not modelled",
                        n + 1
                    )));
                }
                if bit(value, 0) && !bit(channel.ccr, 0) {
                    (channel.all, channel.done) = (channel.count, 0);
                }
                channel.ccr = value;
            }
            Register::Count => channel.count = value & 0xFFFF,
            Register::Peripheral => channel.peripheral = value,
            Register::Memory => channel.memory = value,
            Register::Request => {
                // EGE (bit 9) makes an event of a transfer, to which nobody listens.
                if value & !(0x7F | 1 << 9) != 0 {
                    return Err(Trouble::used("synchronisation in the multiplexer is not modelled"));
                }
                channel.request = value;
            }
        }
        Ok(())
    }
}

enum Register {
    Control,
    Count,
    Peripheral,
    Memory,
    Request,
}

fn place(offset: u32) -> Answer<(usize, Register)> {
    if let Some(within) = offset.checked_sub(MULTIPLEXER) {
        let n = within as usize / 4;
        return if n < CHANNELS { Ok((n, Register::Request)) } else { Err(Trouble::Register) };
    }
    let within = offset.checked_sub(8).ok_or(Trouble::Register)?;
    let n = (within / 20) as usize;
    let register = match within % 20 {
        0 => Register::Control,
        4 => Register::Count,
        8 => Register::Peripheral,
        12 => Register::Memory,
        _ => return Err(Trouble::Register),
    };
    if n < CHANNELS { Ok((n, register)) } else { Err(Trouble::Register) }
}
