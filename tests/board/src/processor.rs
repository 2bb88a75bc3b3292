//! The processor: Unicorn executes instructions; exceptions, sleep and virtual time are added here.
//!
//! - **Time.** A hook at the begin of each block counts its instructions and stops the emulator when a peripheral is
//!   due and an exception follows. Interrupts are therefore taken between blocks, a few instructions late at most.
//!   Nothing else may stop it: an emulator that is stopped by an access to a device executes the instruction once more.
//! - **Entry and return** follow ARMv7-M ARM, sections B1.5.6 to B1.5.8; both forget exclusive accesses. Floating-point
//!   registers are stacked lazily, where the handler's first block with such an instruction begins, unless
//!   FPCCR.LSPEN = 0. A block with one while CPACR keeps the FPU off ends the run.
//! - **Return** is a jump to 0xFFFF_FFxx. The emulator notices some by itself; for the others a page is mapped there,
//!   at which the hook stops.
//! - **Sleep.** The emulator reports WFE as an invalid instruction with the program counter behind it, and halts at
//!   WFI. The event register is set by SEV (seen when its block begins), by entry and return, and by SEVONPEND.

use std::cell::RefCell;
use std::rc::Rc;

use unicorn_engine::{Arch, HookType, Mode, Prot, RegisterARM as R, Unicorn};

use crate::analog::Analog;
use crate::blocks::{Block, Blocks};
use crate::exceptions::{HARD_FAULT, Masks, SV_CALL};
use crate::fault::Fault;
use crate::image::Image;
use crate::machine::{Machine, Memory};
use crate::peripherals::flash::BANK_2;

/// The program, in bank 1.
const FLASH: u32 = 0x0800_0000;
/// SRAM1 and SRAM2.
pub const RAM: u32 = 0x2000_0000;
/// Length of SRAM1 and SRAM2.
pub const RAM_LENGTH: usize = 0x1_8000;
/// CCM-SRAM.
pub const CCM: u32 = 0x1000_0000;
/// Length of the CCM-SRAM.
pub const CCM_LENGTH: usize = 0x8000;
/// Below the RAM the bus answers nobody (RM0440, memory map: reserved): a stack that is too deep ends here.
const BELOW_RAM: std::ops::Range<u32> = 0x1FFF_F900..RAM;
/// Where values of EXC_RETURN lie.
const RETURN_PAGE: u32 = 0xFFFF_F000;
/// Cycles of an entry and of a return (Cortex-M4 technical reference manual, exception handling).
const ENTRY_CYCLES: u64 = 12;
/// Cycles of stacking or unstacking S0 to S15 and FPSCR: an entry that does it takes 29 instead of 12.
const FLOAT_CYCLES: u64 = 17;
/// Where the emulator is given CLREX to execute: below 0xE0000000, where it may, and nowhere near the chip's memory.
const CLREX_AT: u32 = 0x0FFF_F000;
/// CLREX (ARMv7-M ARM, section A7.7.23).
const CLREX: [u8; 4] = [0xBF, 0xF3, 0x2F, 0x8F];

/// Devices: first address and length.
const DEVICES: [(u32, u64); 7] = [
    (BANK_2, 0x4_0000),
    (0x1FFF_7000, 0x1000),
    (0x4000_0000, 0x3_0000),
    (0x4800_0000, 0x2000),
    (0x5000_0000, 0x2000),
    (0xE000_0000, 0x1_0000),
    (0xE004_2000, 0x1000),
];

/// What hooks and the board share.
pub struct Shared {
    /// The machine.
    pub machine: Machine,
    /// What stands at the converter's pins.
    pub analog: Box<dyn Analog>,
    blocks: Blocks,
    /// The emulator has been told to stop; what it does until then does not count.
    stopping: bool,
    why: Why,
}

/// Why the emulator stopped, beyond an exception that is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Why {
    Due,
    Return,
    Sleep,
    Undefined,
    Call,
    /// An access below the RAM, to this address.
    Bus(u32),
}

/// Whether and how the processor sleeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sleep {
    /// It runs.
    Awake,
    /// WFE.
    Event,
    /// WFI.
    Interrupt,
}

/// The processor with its memory.
pub struct Processor {
    emulator: Unicorn<'static, ()>,
    shared: Rc<RefCell<Shared>>,
    sleep: Sleep,
}

/// Registers, memory and sleep at one moment; goes with a copy of the [`Machine`].
pub struct State {
    context: unicorn_engine::Context,
    ram: Vec<u8>,
    ccm: Vec<u8>,
    sleep: Sleep,
}

impl Memory for Unicorn<'_, ()> {
    fn load(&self, address: u32) -> Option<u8> {
        let mut byte = [0];
        self.mem_read(address.into(), &mut byte).ok()?;
        Some(byte[0])
    }

    fn store(&mut self, address: u32, byte: u8) -> bool {
        self.mem_write(address.into(), &[byte]).is_ok()
    }
}

fn broken(what: &str) -> impl Fn(unicorn_engine::uc_error) -> Fault {
    let what = what.to_owned();
    move |e| Fault::Processor { pc: 0, what: format!("{what}: {e:?}") }
}

impl Processor {
    /// A processor with an image in its flash, before its reset.
    ///
    /// # Errors
    /// An image that is not within bank 1.
    pub fn new(image: &Image, machine: Machine, analog: Box<dyn Analog>) -> Result<Self, Fault> {
        let mut emulator = Unicorn::new(Arch::ARM, Mode::THUMB | Mode::MCLASS).map_err(broken("no emulator"))?;
        emulator.ctl_set_cpu_model(unicorn_engine::ArmCpuModel::CORTEX_M4 as i32).map_err(broken("no Cortex-M4"))?;
        let shared = Rc::new(RefCell::new(Shared {
            machine,
            analog,
            blocks: Blocks::default(),
            stopping: false,
            why: Why::Due,
        }));
        map(&mut emulator, &shared).map_err(broken("memory cannot be mapped"))?;
        hook(&mut emulator, &shared).map_err(broken("a hook cannot be set"))?;
        for (address, bytes) in &image.segments {
            let end = address.saturating_add(bytes.len() as u32);
            if *address < FLASH || end > BANK_2 {
                return Err(Fault::Image(format!("{address:#010x} … {end:#010x} is not in bank 1 of the flash")));
            }
            emulator.mem_write((*address).into(), bytes).map_err(broken("the image cannot be written"))?;
        }
        let mut processor = Self { emulator, shared, sleep: Sleep::Awake };
        processor.reset()?;
        Ok(processor)
    }

    /// The machine and what is connected to it.
    pub fn shared(&self) -> &Rc<RefCell<Shared>> {
        &self.shared
    }

    fn get(&self, register: R) -> u32 {
        self.emulator.reg_read(register).unwrap_or_default() as u32
    }

    fn set(&mut self, register: R, value: u32) {
        // Every register named in this file exists in a Cortex-M4F.
        let _ = self.emulator.reg_write(register, value.into());
    }

    /// Reads a word of memory.
    pub fn word(&self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.emulator.mem_read(address.into(), &mut bytes).ok()?;
        Some(u32::from_le_bytes(bytes))
    }

    /// Writes a word of memory.
    pub fn set_word(&mut self, address: u32, value: u32) -> bool {
        self.emulator.mem_write(address.into(), &value.to_le_bytes()).is_ok()
    }

    /// A vector: at address zero the main flash is mirrored (RM0440, section 2.6).
    fn vector(&self, number: usize) -> Option<u32> {
        let base = self.shared.borrow().machine.system.vtor;
        let base = if base < 0x8_0000 { base + FLASH } else { base };
        self.word(base + 4 * number as u32)
    }

    /// ARMv7-M ARM, section B1.5.5.
    fn reset(&mut self) -> Result<(), Fault> {
        self.set(R::CONTROL, 0);
        self.set(R::IPSR, 0);
        for (register, value) in
            [(R::PRIMASK, 0), (R::FAULTMASK, 0), (R::BASEPRI, 0), (R::FPSCR, 0), (R::EPSR, 1 << 24)]
        {
            self.set(register, value);
        }
        let (Some(stack), Some(begin)) = (self.vector(0), self.vector(1)) else {
            return Err(Fault::Image("there are no vectors".to_owned()));
        };
        self.set(R::SP, stack & !3);
        self.set(R::LR, u32::MAX);
        self.set(R::PC, begin);
        self.sleep = Sleep::Awake;
        Ok(())
    }

    fn masks(&self) -> Masks {
        masks(&self.emulator)
    }

    /// Runs until a cycle, at least.
    ///
    /// # Errors
    /// What the model does not have, or a processor would not survive.
    pub fn run(&mut self, until: u64) -> Result<(), Fault> {
        self.shared.borrow_mut().machine.set_limit(until);
        loop {
            if let Some(reset) = self.look_after()? {
                {
                    let shared = &mut *self.shared.borrow_mut();
                    shared.machine.restart(reset);
                    shared.analog.start();
                }
                self.reset()?;
                continue;
            }
            if self.shared.borrow().machine.now >= until {
                return Ok(());
            }
            let masks = self.masks();
            let due = self.shared.borrow().machine.exceptions.due(masks);
            if let Some(number) = due {
                self.sleep = Sleep::Awake;
                self.enter(number)?;
                continue;
            }
            if self.sleep == Sleep::Awake {
                self.execute()?;
            } else {
                self.doze();
            }
        }
    }

    /// What went wrong, or the reset that is due.
    fn look_after(&self) -> Result<Option<crate::peripherals::rcc::Reset>, Fault> {
        let machine = &mut self.shared.borrow_mut().machine;
        match machine.fault.take() {
            Some(fault) => Err(fault),
            None => Ok(machine.reset.take()),
        }
    }

    /// Sleeps until the next event, or wakes.
    fn doze(&mut self) {
        let Shared { machine, analog, .. } = &mut *self.shared.borrow_mut();
        let wakes = match self.sleep {
            Sleep::Event => machine.event,
            _ => machine.exceptions.any_pending(),
        };
        if wakes {
            machine.event &= self.sleep != Sleep::Event;
            self.sleep = Sleep::Awake;
            return;
        }
        machine.sleep_until(machine.next);
        machine.advance(&mut self.emulator, &mut **analog);
    }

    fn execute(&mut self) -> Result<(), Fault> {
        {
            let shared = &mut *self.shared.borrow_mut();
            (shared.stopping, shared.why) = (false, Why::Due);
        }
        let pc = self.get(R::PC);
        let ended = self.emulator.emu_start(u64::from(pc | 1), 0, 0, 0);
        let why = self.shared.borrow().why;
        let stopped = self.shared.borrow().stopping;
        if self.shared.borrow().machine.fault.is_some() {
            return Ok(());
        }
        let pc = self.get(R::PC);
        match (ended, why) {
            (_, Why::Bus(address)) => {
                // PRECISERR and BFARVALID, escalated: bus faults of their own are not modelled.
                self.fault_hard(1 << 9 | 1 << 15, &format!("an access to {address:#010x} in the handler of faults"))
            }
            (Err(e), _) => Err(Fault::Processor { pc, what: format!("{e:?}") }),
            (Ok(()), Why::Return) => self.leave(pc | 1),
            (Ok(()), Why::Sleep) => {
                self.sleep = Sleep::Event;
                Ok(())
            }
            (Ok(()), Why::Call) => {
                self.shared.borrow_mut().machine.exceptions.pend(SV_CALL);
                Ok(())
            }
            // UNDEFINSTR, escalated: usage faults of their own are not modelled.
            (Ok(()), Why::Undefined) => self.fault_hard(1 << 16, "a fault in the handler of faults"),
            (Ok(()), Why::Due) if stopped => Ok(()),
            (Ok(()), Why::Due) => {
                self.sleep = Sleep::Interrupt;
                Ok(())
            }
        }
    }

    /// A hard fault by escalation (FORCED), with these bits of CFSR.
    fn fault_hard(&mut self, cfsr: u32, lockup: &str) -> Result<(), Fault> {
        let (masks, pc) = (self.masks(), self.get(R::PC));
        let machine = &mut self.shared.borrow_mut().machine;
        machine.system.cfsr |= cfsr;
        machine.system.hfsr |= 1 << 30;
        machine.exceptions.pend(HARD_FAULT);
        if machine.exceptions.due(masks) != Some(HARD_FAULT) {
            return Err(Fault::Processor { pc, what: format!("lockup: {lockup}") });
        }
        Ok(())
    }

    /// Exception entry.
    fn enter(&mut self, number: usize) -> Result<(), Fault> {
        let control = self.get(R::CONTROL);
        let xpsr = self.get(R::XPSR);
        let in_thread = xpsr & 0x1FF == 0;
        let with_floats = control & 4 != 0;
        let on_process_stack = in_thread && control & 2 != 0;
        let sp = self.get(R::SP);
        let length = if with_floats { 0x68 } else { 0x20 };
        let frame = (sp - length) & !7;
        let padded = u32::from((sp - length) & 4 != 0);
        let registers = [R::R0, R::R1, R::R2, R::R3, R::R12, R::LR, R::PC];
        let mut words: Vec<u32> = registers.iter().map(|&register| self.get(register)).collect();
        words.push(xpsr & !(1 << 9) | padded << 9);
        if with_floats && self.shared.borrow_mut().machine.system.reserve(frame + 0x20) {
            words.extend(floats(&self.emulator));
            self.shared.borrow_mut().machine.now += FLOAT_CYCLES;
        }
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let pc = self.get(R::PC);
        match self.emulator.mem_write(frame.into(), &bytes) {
            Ok(()) => {}
            // The fault of the stacking comes first (ARMv7-M ARM, section B1.5.10, derived exceptions): STKERR. Its own
            // frame is lost.
            Err(_) if BELOW_RAM.contains(&frame) && number != HARD_FAULT => {
                return self.fault_hard(1 << 12, "the stack of the handler of faults is at its end");
            }
            Err(_) if BELOW_RAM.contains(&frame) => {}
            Err(_) => return Err(Fault::Memory { address: frame, access: "stacking", pc }),
        }
        self.forget_exclusive()?;
        self.set(R::SP, frame);
        // The handler runs on the main stack, without a floating-point context of its own yet.
        self.set(R::CONTROL, control & 1);
        self.set(R::IPSR, number as u32);
        self.set(R::EPSR, 1 << 24);
        let kind = match (in_thread, on_process_stack) {
            (false, _) => 0x1,
            (true, false) => 0x9,
            (true, true) => 0xD,
        };
        let ret = 0xFFFF_FFE0 | kind | if with_floats { 0 } else { 0x10 };
        self.set(R::LR, ret);
        let handler = self.vector(number).filter(|address| address & 1 == 1);
        let handler =
            handler.ok_or_else(|| Fault::Processor { pc, what: format!("exception {number} has no handler") })?;
        self.set(R::PC, handler);
        let machine = &mut self.shared.borrow_mut().machine;
        machine.event = true;
        machine.now += ENTRY_CYCLES;
        machine.entered(number);
        Ok(())
    }

    /// Exception return.
    fn leave(&mut self, value: u32) -> Result<(), Fault> {
        let number = self.get(R::IPSR) as usize & 0x1FF;
        let refuse = |what: &str| Fault::Processor { pc: value, what: what.to_owned() };
        if number == 0 {
            return Err(refuse("an exception return without an exception"));
        }
        let (to_thread, on_process_stack) = match value & 0xF {
            0x1 => (false, false),
            0x9 => (true, false),
            0xD => (true, true),
            _ => return Err(refuse("EXC_RETURN has a value that is none")),
        };
        let with_floats = value & 0x10 == 0;
        if number != 2 {
            self.set(R::FAULTMASK, 0);
        }
        // The stack of the interrupted program.
        self.set(R::CONTROL, self.get(R::CONTROL) & 1);
        self.set(R::IPSR, 0);
        self.set(R::CONTROL, self.get(R::CONTROL) & 1 | u32::from(on_process_stack) << 1 | u32::from(with_floats) << 2);
        let frame = self.get(R::SP);
        let length = if with_floats { 0x68 } else { 0x20 };
        let mut bytes = vec![0; length];
        self.emulator.mem_read(frame.into(), &mut bytes).map_err(|_| Fault::Memory {
            address: frame,
            access: "unstacking",
            pc: value,
        })?;
        let words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
        for (register, &word) in [R::R0, R::R1, R::R2, R::R3, R::R12, R::LR].into_iter().zip(&words) {
            self.set(register, word);
        }
        let (pc, xpsr) = (words[6], words[7]);
        // Registers that nobody has used meanwhile are as they were.
        if with_floats && self.shared.borrow_mut().machine.system.take_reserved().is_none() {
            self.shared.borrow_mut().machine.now += FLOAT_CYCLES;
            for (n, &word) in words[8..24].iter().enumerate() {
                self.set(single(n), word);
            }
            self.set(R::FPSCR, words[24]);
        }
        self.set(R::SP, (frame + length as u32) | (xpsr >> 9 & 1) << 2);
        if (xpsr & 0x1FF == 0) != to_thread {
            return Err(refuse("EXC_RETURN and the stacked IPSR disagree"));
        }
        self.forget_exclusive()?;
        self.set(R::XPSR_NZCVQG, xpsr & !(1 << 9) | 1 << 24);
        self.set(R::PC, pc | 1);
        let machine = &mut self.shared.borrow_mut().machine;
        machine.exceptions.leave(number);
        machine.event = true;
        machine.now += ENTRY_CYCLES;
        Ok(())
    }

    /// Entry and return clear the exclusive monitor (ARMv7-M ARM, section B1.5.6), which only an instruction can do
    /// here.
    fn forget_exclusive(&mut self) -> Result<(), Fault> {
        self.shared.borrow_mut().stopping = true;
        let end = u64::from(CLREX_AT) + CLREX.len() as u64;
        self.emulator.emu_start(u64::from(CLREX_AT | 1), end, 0, 0).map_err(broken("CLREX"))
    }

    /// Keeps registers and memory.
    ///
    /// # Errors
    /// The emulator's.
    pub fn save(&self) -> Result<State, Fault> {
        let failed = broken("the state cannot be kept");
        Ok(State {
            context: self.emulator.context_init().map_err(&failed)?,
            ram: self.emulator.mem_read_as_vec(RAM.into(), RAM_LENGTH).map_err(&failed)?,
            ccm: self.emulator.mem_read_as_vec(CCM.into(), CCM_LENGTH).map_err(&failed)?,
            sleep: self.sleep,
        })
    }

    /// Goes back to a state.
    ///
    /// # Errors
    /// The emulator's.
    pub fn restore(&mut self, state: &State) -> Result<(), Fault> {
        let failed = broken("the state cannot be restored");
        self.emulator.context_restore(&state.context).map_err(&failed)?;
        self.emulator.mem_write(RAM.into(), &state.ram).map_err(&failed)?;
        self.emulator.mem_write(CCM.into(), &state.ccm).map_err(&failed)?;
        self.sleep = state.sleep;
        Ok(())
    }

    /// The program goes on elsewhere, or with its stack elsewhere.
    pub fn divert(&mut self, register: R, value: u32) {
        self.set(register, value);
        self.sleep = Sleep::Awake;
    }

    /// Power goes and comes again so soon that memory is kept.
    ///
    /// # Errors
    /// The emulator's.
    pub fn dip(&mut self) -> Result<(), Fault> {
        self.reset()
    }

    /// Power goes and comes again: memory is arbitrary, here a pattern that is neither zero nor erased.
    ///
    /// # Errors
    /// The emulator's.
    pub fn power_up(&mut self) -> Result<(), Fault> {
        let failed = broken("memory cannot be written");
        self.emulator.mem_write(RAM.into(), &[0xC3; RAM_LENGTH]).map_err(&failed)?;
        self.emulator.mem_write(CCM.into(), &[0xC3; CCM_LENGTH]).map_err(&failed)?;
        self.reset()
    }
}

/// A single-precision register.
fn single(n: usize) -> R {
    const ALL: [R; 16] = [
        R::S0,
        R::S1,
        R::S2,
        R::S3,
        R::S4,
        R::S5,
        R::S6,
        R::S7,
        R::S8,
        R::S9,
        R::S10,
        R::S11,
        R::S12,
        R::S13,
        R::S14,
        R::S15,
    ];
    ALL[n % 16]
}

/// S0 to S15, FPSCR and a word that is reserved, as an extended frame holds them.
fn floats(emulator: &Unicorn<'_, ()>) -> impl Iterator<Item = u32> {
    let get = |register: R| emulator.reg_read(register).unwrap_or_default() as u32;
    (0..16).map(single).chain([R::FPSCR]).map(get).chain([0])
}

fn masks(emulator: &Unicorn<'_, ()>) -> Masks {
    let get = |register: R| emulator.reg_read(register).unwrap_or_default() as u32;
    Masks { primask: get(R::PRIMASK) & 1 == 1, faultmask: get(R::FAULTMASK) & 1 == 1, basepri: get(R::BASEPRI) as u8 }
}

fn map(emulator: &mut Unicorn<'static, ()>, shared: &Rc<RefCell<Shared>>) -> Result<(), unicorn_engine::uc_error> {
    emulator.mem_map(FLASH.into(), u64::from(BANK_2 - FLASH), Prot::READ | Prot::EXEC)?;
    emulator.mem_map(RAM.into(), RAM_LENGTH as u64, Prot::ALL)?;
    emulator.mem_map(CCM.into(), CCM_LENGTH as u64, Prot::ALL)?;
    emulator.mem_map(RETURN_PAGE.into(), 0x1000, Prot::READ | Prot::EXEC)?;
    // Branches to themselves: nothing beyond the end of memory is looked at.
    emulator.mem_write(RETURN_PAGE.into(), &[0xFE, 0xE7].repeat(0x800))?;
    emulator.mem_map(CLREX_AT.into(), 0x1000, Prot::EXEC)?;
    emulator.mem_write(CLREX_AT.into(), &CLREX)?;
    for (base, length) in DEVICES {
        let (reader, writer) = (Rc::clone(shared), Rc::clone(shared));
        let read = move |emulator: &mut Unicorn<'_, ()>, offset: u64, bytes: usize| {
            let shared = &mut *reader.borrow_mut();
            shared.machine.read(base + offset as u32, bytes, emulator, &mut *shared.analog).into()
        };
        let write = move |emulator: &mut Unicorn<'_, ()>, offset: u64, bytes: usize, value: u64| {
            let shared = &mut *writer.borrow_mut();
            shared.machine.write(base + offset as u32, bytes, value as u32, emulator, &mut *shared.analog);
        };
        emulator.mmio_map(base.into(), length, Some(read), Some(write))?;
    }
    Ok(())
}

fn stop(emulator: &mut Unicorn<'_, ()>, shared: &mut Shared, why: Why) {
    (shared.stopping, shared.why) = (true, why);
    // It fails only if nothing runs.
    let _ = emulator.emu_stop();
}

fn hook(emulator: &mut Unicorn<'static, ()>, shared: &Rc<RefCell<Shared>>) -> Result<(), unicorn_engine::uc_error> {
    let own = Rc::clone(shared);
    emulator.add_block_hook(1, 0, move |emulator, address, bytes| {
        begin_block(emulator, &mut own.borrow_mut(), address as u32, bytes)
    })?;

    let own = Rc::clone(shared);
    emulator.add_insn_invalid_hook(move |emulator| {
        let shared = &mut *own.borrow_mut();
        let pc = emulator.reg_read(R::PC).unwrap_or_default();
        let mut before = [0; 2];
        // The program counter is behind WFE, and at an undefined instruction.
        let slept = emulator.mem_read(pc.wrapping_sub(2), &mut before).is_ok() && u16::from_le_bytes(before) == WFE;
        let why = if !slept {
            Why::Undefined
        } else if shared.machine.event {
            // The event register is set: WFE clears it and goes on.
            shared.machine.event = false;
            return true;
        } else {
            Why::Sleep
        };
        stop(emulator, shared, why);
        true
    })?;

    let own = Rc::clone(shared);
    emulator.add_intr_hook(move |emulator, number| {
        let shared = &mut *own.borrow_mut();
        match number {
            SWI => stop(emulator, shared, Why::Call),
            EXCEPTION_EXIT => stop(emulator, shared, Why::Return),
            _ => {
                let pc = emulator.reg_read(R::PC).unwrap_or_default() as u32;
                let what = format!("the emulator's exception {number}");
                shared.machine.fault.get_or_insert(Fault::Processor { pc, what });
                stop(emulator, shared, Why::Due);
            }
        }
    })?;

    let own = Rc::clone(shared);
    emulator.add_mem_hook(HookType::MEM_INVALID, 1, 0, move |emulator, kind, address, _, _| {
        let shared = &mut *own.borrow_mut();
        let pc = emulator.reg_read(R::PC).unwrap_or_default() as u32;
        use unicorn_engine::MemType as M;
        let access = match kind {
            M::WRITE_UNMAPPED | M::WRITE_PROT => "write",
            M::FETCH_UNMAPPED | M::FETCH_PROT => "fetch",
            _ => "read",
        };
        if BELOW_RAM.contains(&(address as u32)) && access != "fetch" {
            (shared.stopping, shared.why) = (true, Why::Bus(address as u32));
        } else {
            shared.machine.fault.get_or_insert(Fault::Memory { address: address as u32, access, pc });
        }
        false
    })?;
    Ok(())
}

/// WFE (ARMv7-M ARM, section A7.7.260).
const WFE: u16 = 0xBF20;
/// The emulator's number for SVC.
const SWI: u32 = 2;
/// The emulator's number for a return from an exception, where it notices one itself.
const EXCEPTION_EXIT: u32 = 8;

/// At the begin of a block of instructions.
#[inline]
fn begin_block(emulator: &mut Unicorn<'_, ()>, shared: &mut Shared, address: u32, bytes: u32) {
    if shared.stopping {
        return;
    }
    if address >= RETURN_PAGE {
        stop(emulator, shared, Why::Return);
        return;
    }
    let machine = &mut shared.machine;
    machine.pc = address;
    if machine.now >= machine.next {
        machine.advance(emulator, &mut *shared.analog);
        if machine.is_over() {
            stop(emulator, shared, Why::Due);
            return;
        }
    }
    if machine.exceptions.knocks() && machine.exceptions.due(masks(emulator)).is_some() {
        stop(emulator, shared, Why::Due);
        return;
    }
    let block = shared.blocks.get(address, bytes).unwrap_or_else(|| {
        let mut code = vec![0; bytes as usize];
        let _ = emulator.mem_read(address.into(), &mut code);
        let halfwords: Vec<u16> = code.as_chunks::<2>().0.iter().map(|&half| u16::from_le_bytes(half)).collect();
        let block = Block::new(&halfwords);
        shared.blocks.put(address, block);
        block
    });
    if let Some(offset) = block.floats {
        let pc = address + u32::from(offset);
        if let Err(fault) = begin_floats(emulator, &mut shared.machine, pc) {
            shared.machine.fault.get_or_insert(fault);
            stop(emulator, shared, Why::Due);
            return;
        }
    }
    shared.machine.event |= block.sends_event;
    shared.machine.spend(block.instructions.into());
}

/// Before a block with floating-point instructions, the first of them at `pc`.
#[inline]
fn begin_floats(emulator: &mut Unicorn<'_, ()>, machine: &mut Machine, pc: u32) -> Result<(), Fault> {
    if !machine.system.fpu_is_on() {
        let what = "a floating-point instruction while CPACR keeps the FPU off (usage fault NOCP)".to_owned();
        return Err(Fault::Processor { pc, what });
    }
    let Some(address) = machine.system.take_reserved() else { return Ok(()) };
    let bytes: Vec<u8> = floats(emulator).flat_map(u32::to_le_bytes).collect();
    machine.now += FLOAT_CYCLES;
    emulator.mem_write(address.into(), &bytes).map_err(|_| Fault::Memory { address, access: "stacking", pc })
}
