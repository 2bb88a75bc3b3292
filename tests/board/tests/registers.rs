//! The model's registers, bits, interrupts and requests against those of the manufacturer, as stm32-data has extracted
//! them (crate `stm32-metapac`), and the processor's against crate `cortex-m`. Every register and bit is named here;
//! its place comes from there.

use std::collections::BTreeSet;

use greyrig_board::analog::Counts;
use greyrig_board::machine::{Machine, Memory, Pace};
use greyrig_board::peripherals::dma::{USART2_RX, USART2_TX};
use greyrig_board::peripherals::flash::{BANK_2, BANK_LENGTH, Contents, PAGE};
use greyrig_board::processor::{CCM, CCM_LENGTH, RAM, RAM_LENGTH};
use stm32_metapac::metadata::ir::{Array, BitOffset, Block, BlockItem, BlockItemInner, FieldSet, IR};
use stm32_metapac::metadata::{METADATA, Peripheral};

/// Peripherals of which something is modelled; the multiplexer's sixteen channels serve two controllers, of which one
/// is.
const MODELLED: [&str; 25] = [
    "TIM1", "COMP1", "COMP2", "DAC3", "UID", "TIM2", "TIM5", "IWDG", "USART2", "PWR", "SYSCFG", "TIM15", "DMA1",
    "DMAMUX1", "RCC", "FLASH", "GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG", "ADC1", "DBGMCU",
];

fn peripheral(name: &str) -> &'static Peripheral {
    METADATA.peripherals.iter().find(|p| p.name == name).expect("a peripheral")
}

fn ir(name: &str) -> (&'static IR, &'static Block) {
    let registers = peripheral(name).registers.as_ref().expect("registers");
    // Blocks have names such as TIM_GP32 there and TimGp32 here.
    let plain = |name: &str| name.replace('_', "").to_lowercase();
    let block = registers.ir.blocks.iter().find(|b| plain(b.name) == plain(registers.block)).expect("a block");
    (registers.ir, block)
}

/// A block's own items and those of the blocks that it extends.
fn items(ir: &'static IR, block: &'static Block) -> Vec<&'static BlockItem> {
    let base = block.extends.and_then(|name| ir.blocks.iter().find(|b| b.name == name));
    let inherited = base.map(|base| items(ir, base)).unwrap_or_default();
    block.items.iter().chain(inherited).collect()
}

/// Offsets of the places of an array, or of what is none.
fn places(array: &Option<Array>) -> Vec<u32> {
    match array {
        None => vec![0],
        Some(Array::Regular(array)) => (0..array.len).map(|n| n * array.stride).collect(),
        Some(Array::Cursed(array)) => array.offsets.to_vec(),
    }
}

/// A name and the number behind it in brackets.
fn numbered(name: &str) -> (&str, usize) {
    name.split_once('[').map_or((name, 0), |(name, n)| (name, n.trim_end_matches(']').parse().expect("a number")))
}

/// Address and fields of a register, such as `ADC1.smpr[1]` or `DMA1.ch[0].cr`.
fn register(path: &str) -> (u32, &'static [FieldSet], Option<&'static str>) {
    let mut parts = path.split('.');
    let name = parts.next().expect("a peripheral");
    let (ir, mut block) = ir(name);
    let mut address = peripheral(name).address as u32;
    for part in parts {
        let (name, n) = numbered(part);
        let items = items(ir, block);
        let item = items.iter().find(|item| item.name == name).unwrap_or_else(|| panic!("{path}"));
        address += item.byte_offset + places(&item.array)[n];
        match &item.inner {
            BlockItemInner::Register(register) => return (address, ir.fieldsets, register.fieldset),
            BlockItemInner::Block(inner) => {
                block = ir.blocks.iter().find(|b| b.name == inner.block).expect("a block");
            }
        }
    }
    panic!("{path} is no register");
}

/// First bit and width of a field of a register, and the register's address.
fn field(path: &str, field: &str) -> (u32, u32, u32) {
    fn find(sets: &'static [FieldSet], set: &str, name: &str) -> Option<&'static stm32_metapac::metadata::ir::Field> {
        let set = sets.iter().find(|s| s.name == set)?;
        set.fields.iter().find(|f| f.name == name).or_else(|| find(sets, set.extends?, name))
    }
    let (address, sets, set) = register(path);
    let (name, n) = numbered(field);
    let field = find(sets, set.expect("fields"), name).unwrap_or_else(|| panic!("{path}.{field}"));
    let (first, width) = match &field.bit_offset {
        BitOffset::Regular(bits) => (bits.offset, field.bit_size),
        // The lower part of a field in two parts, such as MMS.
        BitOffset::Cursed(bits) => (*bits.ranges[0].start(), bits.ranges[0].clone().count() as u32),
    };
    (address, first + places(&field.array)[n], width)
}

fn value(path: &str, fields: &[(&str, u32)]) -> u32 {
    fields.iter().fold(0, |all, (name, value)| all | value << field(path, name).1)
}

struct NoMemory;

impl Memory for NoMemory {
    fn load(&self, _: u32) -> Option<u8> {
        Some(b'x')
    }

    fn store(&mut self, _: u32, _: u8) -> bool {
        true
    }
}

struct Chip {
    machine: Machine,
    pins: Counts<std::vec::IntoIter<[u16; 3]>>,
}

impl Chip {
    fn new() -> Self {
        let machine = Machine::new(Pace::ONE, Contents::default());
        Self { machine, pins: Counts::new(vec![[1111, 2222, 3333]; 10].into_iter()) }
    }

    /// With the clocks of these peripherals on, by their own enable bits.
    fn with(names: &[&str]) -> Self {
        let mut chip = Self::new();
        for enable in names.iter().filter_map(|name| peripheral(name).rcc.as_ref()?.enable.as_ref()) {
            let register = format!("RCC.{}", enable.register.to_lowercase());
            chip.set(&register, &[(&enable.field.to_lowercase(), 1)]);
        }
        chip
    }

    fn load(&mut self, address: u32) -> u32 {
        self.machine.read(address, 4, &mut NoMemory, &mut self.pins)
    }

    fn store(&mut self, address: u32, value: u32) {
        self.machine.write(address, 4, value, &mut NoMemory, &mut self.pins);
        assert_eq!(self.machine.fault, None);
    }

    /// Writes a register: these fields, zeros elsewhere.
    fn put(&mut self, path: &str, fields: &[(&str, u32)]) {
        self.store(register(path).0, value(path, fields));
    }

    /// Writes a register as a whole.
    fn whole(&mut self, path: &str, value: u32) {
        self.store(register(path).0, value);
    }

    /// Changes fields of a register.
    fn set(&mut self, path: &str, fields: &[(&str, u32)]) {
        let mut all = self.load(register(path).0);
        for (name, value) in fields {
            let (_, first, width) = field(path, name);
            let mask = (u32::MAX >> (32 - width)) << first;
            all = all & !mask | value << first & mask;
        }
        self.store(register(path).0, all);
    }

    fn get(&mut self, path: &str, name: &str) -> u32 {
        let (address, first, width) = field(path, name);
        self.load(address) >> first & u32::MAX >> (32 - width)
    }

    fn pass(&mut self, cycles: u64) {
        self.machine.now += cycles;
        self.machine.advance(&mut NoMemory, &mut self.pins);
        assert_eq!(self.machine.fault, None);
    }

    /// Whether exactly this interrupt is pending (NVIC_ISPR).
    fn pending(&mut self, name: &str) -> bool {
        let number = METADATA.interrupts.iter().find(|i| i.name == name).expect("an interrupt").number;
        (0..4).all(|n| self.load(0xE000_E200 + 4 * n) == u32::from(n == number / 32) << (number % 32))
    }
}

/// What the model answers is a register of the chip, and so are its addresses; nothing else is answered in their place.
#[test]
fn registers_are_where_the_chip_has_them() {
    for name in MODELLED.into_iter().chain(["ADC12_COMMON"]) {
        let (ir, block) = ir(name);
        let base = peripheral(name).address as u32;
        let mut there = BTreeSet::new();
        for item in items(ir, block) {
            for place in places(&item.array) {
                match &item.inner {
                    BlockItemInner::Register(_) => {
                        there.insert(item.byte_offset + place);
                    }
                    BlockItemInner::Block(inner) => {
                        let inner = ir.blocks.iter().find(|b| b.name == inner.block).expect("a block");
                        there.extend(inner.items.iter().map(|i| item.byte_offset + place + i.byte_offset));
                    }
                }
            }
        }
        // Up to the next peripheral.
        let end = METADATA.peripherals.iter().map(|p| p.address as u32).filter(|&a| a > base).min();
        let end = end.unwrap_or(u32::MAX).min(base + 0x400);
        let mut answered = 0;
        for address in (base..end).step_by(4) {
            let mut chip = Chip::with(&MODELLED);
            chip.load(address);
            if chip.machine.fault.is_none() {
                answered += 1;
                assert!(there.contains(&(address - base)), "{name}: {:#x} is no register", address - base);
            }
        }
        assert!(answered > 0, "{name} does not answer");
    }
}

#[test]
fn clocks_are_enabled_by_their_own_bits() {
    for name in MODELLED {
        let address = peripheral(name).address as u32;
        let Some(enable) = peripheral(name).rcc.as_ref().and_then(|rcc| rcc.enable.as_ref()) else { continue };
        let mut off = Chip::new();
        let (register, name) = (format!("RCC.{}", enable.register.to_lowercase()), enable.field.to_lowercase());
        off.set(&register, &[(&name, 0)]);
        off.load(address);
        // The flash's interface cannot be without a clock here.
        assert!(off.machine.fault.is_some() || name == "flashen", "{name}");
        let mut on = Chip::new();
        on.set(&register, &[(&name, 1)]);
        on.load(address);
        assert_eq!(on.machine.fault, None, "{name}");
    }
}

#[test]
fn memory_is_where_the_chip_has_it() {
    let dual = METADATA.memory.iter().find(|map| map.iter().any(|m| m.name == "BANK_2")).expect("two banks");
    let region = |name: &str| dual.iter().find(|m| m.name == name).expect("memory");
    let bank = region("BANK_2");
    assert_eq!((bank.address, bank.size), (BANK_2, BANK_LENGTH as u32));
    let settings = bank.settings.as_ref().expect("settings");
    assert_eq!((settings.erase_size, settings.write_size, settings.erase_value), (PAGE as u32, 8, 0xFF));
    let ccm = region("CCMRAM_ICODE");
    assert_eq!((ccm.address, ccm.size), (CCM, CCM_LENGTH as u32));
    let (first, second) = (region("SRAM1"), region("SRAM2"));
    assert_eq!((first.address, first.address + first.size), (RAM, second.address));
    assert_eq!((first.size + second.size) as usize, RAM_LENGTH);
    assert_eq!(METADATA.nvic_priority_bits, Some(4));
}

/// What is not zero after a reset, as ST's SVD file has it (in crate `stm32g4`, version 0.16.0).
const RESETS: [(&str, u32); 30] = [
    ("RCC.icscr", 0x4000_0000),
    ("RCC.cfgr", 0x5),
    ("RCC.pllcfgr", 0x1000),
    ("RCC.ahb1enr", 0x100),
    ("RCC.apb1enr1", 0x400),
    ("RCC.ahb1smenr", 0x130F),
    ("RCC.ahb2smenr", 0x050F_667F),
    ("RCC.ahb3smenr", 0x101),
    ("RCC.apb1smenr1", 0xD2FE_CD3F),
    ("RCC.apb1smenr2", 0x103),
    ("RCC.apb2smenr", 0x0437_F801),
    ("RCC.csr", 0x0C00_0000),
    ("FLASH.cr", 0xC000_0000),
    ("FLASH.optr", 0xFFEF_F8AA),
    ("GPIOA.moder", 0xABFF_FFFF),
    ("GPIOA.ospeedr", 0x0C00_0000),
    ("GPIOA.pupdr", 0x6400_0000),
    ("GPIOB.moder", 0xFFFF_FEBF),
    ("GPIOB.ospeedr", 0xC0),
    ("GPIOB.pupdr", 0x100),
    ("GPIOC.moder", 0xFFFF_FFFF),
    ("PWR.cr1", 0x200),
    ("PWR.cr3", 0x8000),
    ("PWR.cr5", 0x100),
    ("ADC1.cr", 0x2000_0000),
    ("ADC1.cfgr", 0x8000_0000),
    ("TIM2.arr", 0xFFFF_FFFF),
    ("TIM15.arr", 0xFFFF),
    ("IWDG.rlr", 0xFFF),
    ("SYSCFG.cfgr1", 0x7C00_0001),
];

#[test]
fn values_after_a_reset() {
    for (path, value) in RESETS {
        // Reading needs a clock, which changes the registers that enable it.
        let mut chip = if path.starts_with("RCC") { Chip::new() } else { Chip::with(&MODELLED) };
        assert_eq!(chip.load(register(path).0), value, "{path}");
    }
}

/// The clock tree of the board: 24 MHz by 6 by 85 by 2.
#[test]
fn clocks() {
    let mut chip = Chip::new();
    assert_eq!((chip.get("RCC.cr", "hsion"), chip.get("RCC.cr", "hsirdy"), chip.get("RCC.cr", "hserdy")), (1, 1, 0));
    chip.set("RCC.cr", &[("hseon", 1)]);
    assert_eq!(chip.get("RCC.cr", "hserdy"), 1);
    chip.put("RCC.pllcfgr", &[("pllsrc", 3), ("pllm", 5), ("plln", 85), ("pllren", 1), ("pllr", 0)]);
    chip.set("RCC.cr", &[("pllon", 1)]);
    assert_eq!(chip.get("RCC.cr", "pllrdy"), 1);
    chip.set("FLASH.acr", &[("latency", 4)]);
    chip.set("RCC.cfgr", &[("sw", 3)]);
    assert_eq!((chip.get("RCC.cfgr", "sws"), chip.machine.rcc.hclk_hz()), (3, 170_000_000));
    chip.set("RCC.cfgr", &[("hpre", 0b1001)]);
    assert_eq!(chip.machine.rcc.hclk_hz(), 42_500_000);
    chip.set("RCC.csr", &[("lsion", 1)]);
    assert_eq!((chip.get("RCC.csr", "lsirdy"), chip.get("RCC.csr", "borrstf")), (1, 1));
    chip.set("RCC.csr", &[("rmvf", 1)]);
    assert_eq!(chip.get("RCC.csr", "borrstf"), 0);
    for (on, ready, register) in [("lseon", "lserdy", "RCC.bdcr"), ("hsi48on", "hsi48rdy", "RCC.crrcr")] {
        chip.set(register, &[(on, 1)]);
        assert_eq!(chip.get(register, ready), 1);
    }
    use greyrig_board::peripherals::rcc::{Rcc, Reset};
    for (reset, flag) in [(Reset::Software, "sftrstf"), (Reset::Watchdog, "iwdgrstf"), (Reset::Pin, "pinrstf")] {
        chip.machine.rcc = Rcc::new(reset);
        let set = ["pinrstf", "borrstf", "sftrstf", "iwdgrstf", "wwdgrstf", "lpwrrstf"]
            .map(|name| chip.get("RCC.csr", name) == u32::from(name == flag || name == "pinrstf"));
        assert_eq!(set, [true; 6], "{reset:?}");
    }
}

fn open_flash() -> Chip {
    let mut chip = Chip::new();
    assert_eq!(
        (chip.get("FLASH.cr", "lock"), chip.get("FLASH.cr", "optlock"), chip.get("FLASH.optr", "dbank")),
        (1, 1, 1)
    );
    chip.whole("FLASH.keyr", 0x4567_0123);
    chip.whole("FLASH.keyr", 0xCDEF_89AB);
    assert_eq!(chip.get("FLASH.cr", "lock"), 0);
    chip
}

#[test]
fn flash() {
    let mut chip = open_flash();
    chip.put("FLASH.cr", &[("pg", 1), ("eopie", 1)]);
    chip.store(BANK_2 + 0x1008, 1);
    chip.store(BANK_2 + 0x100C, 2);
    assert_eq!(chip.get("FLASH.sr", "bsy"), 1);
    chip.pass(17_000);
    assert_eq!((chip.get("FLASH.sr", "bsy"), chip.get("FLASH.sr", "eop")), (0, 1));
    assert!(chip.pending("FLASH"));
    chip.put("FLASH.sr", &[("eop", 1)]);
    assert_eq!((chip.load(BANK_2 + 0x1008), chip.load(BANK_2 + 0x100C)), (1, 2));
    for (fields, offset, error) in
        [(&[("pg", 1)][..], 0x1008, "progerr"), (&[("pg", 1)], 0x1014, "pgaerr"), (&[], 0x1010, "pgserr")]
    {
        chip.put("FLASH.cr", fields);
        chip.store(BANK_2 + offset, 5);
        if error == "progerr" {
            chip.store(BANK_2 + offset + 4, 5);
        }
        let (address, first, _) = field("FLASH.sr", error);
        assert_eq!(chip.load(address), 1 << first, "{error}");
        chip.put("FLASH.sr", &[(error, 1)]);
    }
    chip.put("FLASH.cr", &[("per", 1), ("pnb", 2), ("bker", 1), ("strt", 1)]);
    chip.pass(400_000);
    assert_eq!((chip.load(BANK_2 + 0x1008), chip.load(BANK_2 + 0x0FFC)), (u32::MAX, u32::MAX));
    for field in ["mer1", "mer2", "optstrt", "fstpg", "obl_launch"] {
        let address = register("FLASH.cr").0;
        let mut chip = open_flash();
        chip.machine.write(address, 4, value("FLASH.cr", &[(field, 1)]), &mut NoMemory, &mut chip.pins);
        assert!(chip.machine.fault.is_some(), "{field} is not modelled");
    }
}

/// A double word that was cut while it was programmed.
#[test]
fn check_bits() {
    let mut chip = open_flash();
    chip.put("FLASH.cr", &[("pg", 1)]);
    chip.store(BANK_2 + 0x1008, 1);
    chip.store(BANK_2 + 0x100C, 2);
    let contents = chip.machine.flash.cut(|| 2);
    let mut chip = Chip { machine: Machine::new(Pace::ONE, contents), ..chip };
    chip.load(BANK_2 + 0x1008);
    let told = ["eccd", "bk_ecc", "sysf_ecc", "eccc", "addr_ecc"].map(|name| chip.get("FLASH.eccr", name));
    assert_eq!(told, [1, 1, 0, 0, 0x1008]);
    chip.put("FLASH.eccr", &[("eccd", 1)]);
    assert_eq!(chip.get("FLASH.eccr", "eccd"), 0);
}

#[test]
fn timers() {
    for (timer, interrupt) in [("TIM2", "TIM2"), ("TIM15", "TIM1_BRK_TIM15")] {
        let mut chip = Chip::with(&[timer]);
        let path = |name: &str| format!("{timer}.{name}");
        chip.whole(&path("psc"), 1);
        chip.whole(&path("arr"), 99);
        chip.put(&path("egr"), &[("ug", 1)]);
        assert_eq!(chip.get(&path("sr"), "uif"), 1);
        chip.whole(&path("sr"), 0);
        chip.whole(&path("ccr[0]"), 50);
        chip.put(&path("dier"), &[("ccie[0]", 1)]);
        chip.put(&path("cr1"), &[("cen", 1), ("urs", 1), ("arpe", 1)]);
        chip.pass(99);
        assert_eq!((chip.load(register(&path("cnt")).0), chip.get(&path("sr"), "ccif[0]")), (49, 0));
        chip.pass(1);
        assert!(chip.get(&path("sr"), "ccif[0]") == 1 && chip.pending(interrupt), "{timer}");
        chip.put(&path("dier"), &[("uie", 1)]);
        chip.pass(100);
        assert_eq!(chip.get(&path("sr"), "uif"), 1);
        chip.whole(&path("sr"), 0);
        chip.put(&path("cr1"), &[("cen", 1), ("udis", 1)]);
        chip.pass(200);
        assert_eq!(chip.get(&path("sr"), "uif"), 0);
    }
}

/// Input, sampling time, trigger and interrupt of the converter: the sequence of the firmware.
#[test]
fn converter() {
    let mut chip = Chip::with(&["ADC1", "TIM2", "GPIOA", "GPIOC"]);
    chip.set("RCC.ccipr", &[("adc12sel", 2)]);
    chip.put("ADC12_COMMON.ccr", &[("ckmode", 0), ("presc", 2)]);
    assert_eq!(chip.get("ADC1.cr", "deeppwd"), 1);
    chip.set("ADC1.cr", &[("deeppwd", 0)]);
    chip.set("ADC1.cr", &[("advregen", 1)]);
    chip.pass(320);
    chip.set("ADC1.cr", &[("adcal", 1)]);
    assert_eq!(chip.get("ADC1.cr", "adcal"), 1);
    chip.pass(116 * 4);
    assert_eq!(chip.get("ADC1.cr", "adcal"), 0);
    chip.set("ADC1.cr", &[("aden", 1)]);
    chip.pass(100);
    assert_eq!(chip.get("ADC1.isr", "adrdy"), 1);
    chip.put("ADC1.isr", &[("adrdy", 1)]);
    assert_eq!(chip.get("ADC1.isr", "adrdy"), 0);
    chip.put("ADC1.smpr", &[("smp[1]", 3), ("smp[2]", 3), ("smp[6]", 4)]);
    let triggers = peripheral("ADC1").triggers;
    let trigger = triggers.iter().find(|t| t.source == "TIM2_TRGO" && t.signal.starts_with("ADC_JEXT_TRG")).unwrap();
    let trigger = trigger.signal.trim_start_matches("ADC_JEXT_TRG").parse().unwrap();
    chip.put(
        "ADC1.jsqr",
        &[("jl", 2), ("jextsel", trigger), ("jexten", 1), ("jsq[0]", 1), ("jsq[1]", 2), ("jsq[2]", 6)],
    );
    chip.put("ADC1.ier", &[("jeosie", 1)]);
    chip.set("ADC1.cr", &[("jadstart", 1)]);
    chip.put("TIM2.cr2", &[("mms", 2)]);
    chip.put("TIM2.egr", &[("ug", 1)]);
    // (24.5 + 12.5) twice and 47.5 + 12.5 cycles of a fourth of the clock.
    chip.pass(4 * (37 + 37 + 60) - 1);
    assert_eq!(chip.get("ADC1.isr", "jeos"), 0);
    chip.pass(1);
    assert_eq!((chip.get("ADC1.isr", "jeos"), chip.get("ADC1.isr", "jeoc"), chip.pending("ADC1_2")), (1, 1, true));
    let results = [0, 1, 2].map(|n| chip.get(&format!("ADC1.jdr[{n}]"), "jdata"));
    assert_eq!(results, [1111, 2222, 3333]);
    chip.set("ADC1.cr", &[("jadstp", 1)]);
    assert_eq!(chip.get("ADC1.cr", "jadstart"), 0);
    chip.set("ADC1.cr", &[("addis", 1)]);
    assert_eq!(chip.get("ADC1.cr", "aden"), 0);
}

#[test]
fn line_and_dma() {
    let requests = peripheral("USART2").dma_channels;
    let request = |signal: &str| requests.iter().find(|r| r.signal == signal).and_then(|r| r.request).unwrap();
    assert_eq!((request("RX"), request("TX")), (USART2_RX, USART2_TX));
    let mut chip = Chip::with(&["USART2", "DMA1", "DMAMUX1"]);
    chip.whole("USART2.brr", 16);
    chip.put("USART2.cr1", &[("ue", 1), ("re", 1), ("te", 1)]);
    let flags = |chip: &mut Chip| {
        ["txe", "tc", "rxne", "idle", "ore", "teack", "reack"].map(|name| chip.get("USART2.isr", name))
    };
    assert_eq!(flags(&mut chip), [1, 1, 0, 0, 0, 1, 1]);
    chip.put("USART2.tdr", &[("dr", 0x55)]);
    assert_eq!(flags(&mut chip), [1, 0, 0, 0, 0, 1, 1]);
    chip.machine.receive(b"ab");
    chip.pass(160);
    assert_eq!(flags(&mut chip), [1, 1, 1, 0, 0, 1, 1]);
    chip.pass(160);
    assert_eq!(flags(&mut chip), [1, 1, 1, 0, 1, 1, 1]);
    chip.put("USART2.cr1", &[("ue", 1), ("re", 1), ("te", 1), ("idleie", 1)]);
    assert!(!chip.pending("USART2"));
    chip.pass(160);
    assert!(flags(&mut chip) == [1, 1, 1, 1, 1, 1, 1] && chip.pending("USART2"));
    chip.put("USART2.icr", &[("ore", 1), ("idle", 1), ("tc", 1)]);
    assert_eq!(chip.get("USART2.rdr", "dr"), u32::from(b'a'));
    assert_eq!(flags(&mut chip), [1, 0, 0, 0, 0, 1, 1]);

    // Channel 8 of the controller, the last of the first eight of the multiplexer.
    let mut chip = Chip::with(&["USART2", "DMA1", "DMAMUX1"]);
    chip.whole("USART2.brr", 16);
    chip.put("USART2.cr1", &[("ue", 1), ("re", 1), ("te", 1)]);
    chip.put("DMAMUX1.ccr[7]", &[("dmareq_id", request("RX"))]);
    chip.whole("DMA1.ch[7].par", register("USART2.rdr").0);
    chip.whole("DMA1.ch[7].mar", RAM);
    chip.put("DMA1.ch[7].ndtr", &[("ndt", 4)]);
    chip.put("DMA1.ch[7].cr", &[("en", 1), ("minc", 1), ("circ", 1), ("tcie", 1), ("htie", 1)]);
    chip.put("USART2.cr3", &[("dmar", 1), ("eie", 1)]);
    chip.machine.receive(b"abcd");
    chip.pass(320);
    assert!(chip.get("DMA1.isr", "htif[7]") == 1 && chip.pending("DMA1_CHANNEL8"));
    assert_eq!((chip.get("DMA1.ch[7].ndtr", "ndt"), chip.get("DMA1.isr", "tcif[7]")), (2, 0));
    chip.pass(320);
    assert_eq!((chip.get("DMA1.ch[7].ndtr", "ndt"), chip.get("DMA1.isr", "tcif[7]")), (4, 1));
    chip.put("DMA1.ifcr", &[("gif[7]", 1)]);
    assert_eq!((chip.get("DMA1.isr", "tcif[7]"), chip.get("DMA1.isr", "htif[7]")), (0, 0));

    // Channel 1 sends.
    let mut chip = Chip::with(&["USART2", "DMA1", "DMAMUX1"]);
    chip.whole("USART2.brr", 16);
    chip.put("USART2.cr1", &[("ue", 1), ("te", 1), ("fifoen", 1)]);
    chip.put("DMAMUX1.ccr[0]", &[("dmareq_id", request("TX"))]);
    chip.whole("DMA1.ch[0].par", register("USART2.tdr").0);
    chip.whole("DMA1.ch[0].mar", RAM);
    chip.put("DMA1.ch[0].ndtr", &[("ndt", 3)]);
    chip.put("DMA1.ch[0].cr", &[("en", 1), ("minc", 1), ("dir", 1), ("tcie", 1)]);
    assert_eq!((chip.get("USART2.isr", "txfe"), chip.get("USART2.isr", "rxff")), (1, 0));
    chip.put("USART2.cr3", &[("dmat", 1)]);
    assert!(chip.get("DMA1.isr", "tcif[0]") == 1 && chip.pending("DMA1_CHANNEL1"));
    chip.pass(480);
    assert_eq!(chip.machine.usart2.to_host, b"xxx");
    assert_eq!(chip.get("USART2.isr", "tc"), 1);
}

#[test]
fn pins_and_watchdog() {
    let mut chip = Chip::with(&["GPIOB"]);
    chip.set("GPIOB.moder", &[("moder[10]", 1), ("moder[5]", 1)]);
    chip.put("GPIOB.bsrr", &[("bs[10]", 1), ("bs[5]", 1)]);
    assert!(chip.machine.ports[1].is_high(10) && chip.get("GPIOB.idr", "idr[5]") == 1);
    chip.put("GPIOB.bsrr", &[("br[10]", 1)]);
    assert_eq!((chip.get("GPIOB.odr", "odr[10]"), chip.get("GPIOB.odr", "odr[5]")), (0, 1));
    chip.set("GPIOB.moder", &[("moder[3]", 2)]);
    chip.set("GPIOB.afr[0]", &[("afr[3]", 7)]);
    assert_eq!(chip.machine.ports[1].mode(3), greyrig_board::peripherals::gpio::Mode::Alternate(7));

    let mut chip = Chip::new();
    chip.whole("IWDG.kr", 0x5555);
    chip.put("IWDG.pr", &[("pr", 1)]);
    chip.put("IWDG.rlr", &[("rl", 99)]);
    chip.whole("IWDG.kr", 0xCCCC);
    // A hundred periods of an eighth of 32 kHz, at 16 MHz.
    chip.pass(100 * 8 * 500 - 1);
    assert_eq!(chip.machine.reset, None);
    chip.pass(1);
    assert!(chip.machine.reset.is_some());
}

/// The processor's own registers, whose places crate `cortex-m` has.
#[test]
fn registers_of_the_processor() {
    use cortex_m::peripheral::{DCB, DWT, FPU, NVIC, SCB, SYST, dcb, dwt, fpu, nvic, scb, syst};
    use std::mem::offset_of;
    let at = |base: usize, offset: usize| (base + offset) as u32;
    let scb = |offset| at(SCB::PTR as usize, offset);
    let nvic = |offset| at(NVIC::PTR as usize, offset);
    let syst = |offset| at(SYST::PTR as usize, offset);
    let dwt = |offset| at(DWT::PTR as usize, offset);
    let fpu = |offset| at(FPU::PTR as usize, offset);

    let mut chip = Chip::new();
    chip.store(scb(offset_of!(scb::RegisterBlock, vtor)), 0x0800_0200);
    chip.store(scb(offset_of!(scb::RegisterBlock, scr)), 1 << 4);
    assert_eq!((chip.machine.system.vtor, chip.machine.system.event_on_pending), (0x0800_0200, true));
    assert!(!chip.machine.system.fpu_is_on());
    chip.store(scb(offset_of!(scb::RegisterBlock, cpacr)), 0b1111 << 20);
    assert!(chip.machine.system.fpu_is_on());
    assert_eq!(chip.load(fpu(offset_of!(fpu::RegisterBlock, fpccr))), 0xC000_0000);
    chip.machine.system.reserve(RAM + 8);
    assert_eq!(chip.load(fpu(offset_of!(fpu::RegisterBlock, fpcar))), RAM + 8);
    (chip.machine.system.cfsr, chip.machine.system.hfsr) = (1 << 16, 1 << 30);
    for (offset, value) in
        [(offset_of!(scb::RegisterBlock, cfsr), 1 << 16), (offset_of!(scb::RegisterBlock, hfsr), 1 << 30)]
    {
        assert_eq!(chip.load(scb(offset)), value);
        chip.store(scb(offset), value);
        assert_eq!(chip.load(scb(offset)), 0);
    }

    // SysTick: a hundred cycles, from the processor's clock, with its exception.
    chip.store(syst(offset_of!(syst::RegisterBlock, rvr)), 99);
    chip.store(syst(offset_of!(syst::RegisterBlock, cvr)), 0);
    chip.store(syst(offset_of!(syst::RegisterBlock, csr)), 0b111);
    let (icsr, pendst) = (scb(offset_of!(scb::RegisterBlock, icsr)), 1 << 26);
    chip.pass(99);
    assert_eq!(chip.load(icsr) & pendst, 0);
    chip.pass(1);
    assert_eq!(chip.load(icsr) & pendst, pendst);
    chip.store(icsr, 1 << 25);
    assert_eq!(chip.load(icsr) & pendst, 0);
    chip.store(icsr, 1 << 28);
    assert_eq!(chip.load(icsr) >> 12 & 0x1FF, 14);
    chip.store(icsr, 1 << 27);
    chip.store(scb(offset_of!(scb::RegisterBlock, shpr)) + 8, 0x50A0_0000);
    assert_eq!((chip.machine.exceptions.priorities(14), chip.machine.exceptions.priorities(12)), (0x50A0, 0x50A0_0000));

    // Interrupt 38: enabled, made pending, its priority, and back.
    let word = |offset: usize| nvic(offset) + 4;
    chip.store(nvic(offset_of!(nvic::RegisterBlock, ipr)) + 36, 0x70 << 16);
    chip.store(word(offset_of!(nvic::RegisterBlock, iser)), 1 << 6);
    chip.store(word(offset_of!(nvic::RegisterBlock, ispr)), 1 << 6);
    let basepri = |basepri| greyrig_board::exceptions::Masks { basepri, ..Default::default() };
    let due = |chip: &Chip, mask| chip.machine.exceptions.due(basepri(mask));
    assert_eq!((due(&chip, 0x80), due(&chip, 0x70)), (Some(16 + 38), None));
    chip.machine.entered(16 + 38);
    assert_eq!(chip.load(word(offset_of!(nvic::RegisterBlock, iabr))), 1 << 6);
    chip.machine.exceptions.leave(16 + 38);
    chip.store(word(offset_of!(nvic::RegisterBlock, ispr)), 1 << 6);
    chip.store(word(offset_of!(nvic::RegisterBlock, icpr)), 1 << 6);
    assert_eq!(due(&chip, 0), None);
    chip.store(word(offset_of!(nvic::RegisterBlock, icer)), 1 << 6);
    chip.store(word(offset_of!(nvic::RegisterBlock, ispr)), 1 << 6);
    assert_eq!(due(&chip, 0), None);

    // The cycle counter.
    chip.store(at(DCB::PTR as usize, offset_of!(dcb::RegisterBlock, demcr)), 1 << 24);
    chip.store(dwt(offset_of!(dwt::RegisterBlock, ctrl)), 1);
    chip.store(dwt(offset_of!(dwt::RegisterBlock, cyccnt)), 5);
    chip.pass(1000);
    assert_eq!(chip.load(dwt(offset_of!(dwt::RegisterBlock, cyccnt))), 1005);

    chip.store(scb(offset_of!(scb::RegisterBlock, aircr)), 0x05FA_0004);
    assert_eq!(chip.machine.reset, Some(greyrig_board::peripherals::rcc::Reset::Software));
}
