//! The figures of an image, and what must hold for them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::code::{Facts, facts};
use super::elf::Image;

/// Calls through pointers that can be reached, and what they can call: fragments of names. Whatever is not listed is an
/// error.
pub const INDIRECT: &[(&str, &[&str])] = &[
    // The executor polls its tasks, of which there is one; a task wakes itself or another by a waker.
    ("thread::Executor::run", &["embassy_executor::raw::TaskStorage"]),
    ("embassy_executor::raw::TaskStorage", WAKER),
    ("as greyrig::app::board::Board>", WAKER),
    // What of the board is inlined into it.
    ("____embassy_main_task", WAKER),
    ("embassy_stm32::", WAKER),
    ("embassy_sync::", WAKER),
    ("embassy_time", WAKER),
    // The handlers of the driver wake a task.
    ("USART2", WAKER),
    ("DMA1_CHANNEL", WAKER),
    ("TIM1_BRK_TIM15", WAKER),
    // The log's encoder writes by a function of the RTT's.
    ("defmt", &["defmt_rtt::"]),
];

const WAKER: &[&str] = &["embassy_executor::raw::waker::"];

/// Functions that end in a panic.
const PANICS: [&str; 5] = ["core::panicking::", "unwrap_failed", "rust_begin_unwind", "slice_index_fail", "_fail::"];

/// What the processor saves for an interrupt that finds floating-point state, with alignment, bytes.
const EXCEPTION_FRAME: u32 = 108;

/// Entries of the vector table before the interrupts: the stack pointer, reset, and the exceptions.
const RESET: u32 = 1;

/// The deepest that the stack can get.
#[derive(Debug)]
pub struct Stack {
    /// Of the program from reset on, bytes.
    pub thread: u32,
    /// Of the interrupt handlers with what the processor saves: name, bytes.
    pub handlers: Vec<(String, u32)>,
}

impl Stack {
    /// All interrupts on top of the deepest point of the program.
    pub fn bound(&self) -> u32 {
        self.thread + self.handlers.iter().map(|(_, bytes)| bytes).sum::<u32>()
    }
}

/// An image with its calls.
pub struct Program<'a> {
    image: &'a Image,
    facts: BTreeMap<u32, Facts>,
}

impl<'a> Program<'a> {
    /// Reads all functions.
    pub fn new(image: &'a Image) -> Self {
        Self { image, facts: image.functions.iter().map(|(address, f)| (*address, facts(f))).collect() }
    }

    /// The sampling interrupt, by the name of its handler, calls nothing that could panic and nothing through a
    /// pointer; gives how many functions it can call.
    ///
    /// # Errors
    /// The way to what it must not reach.
    pub fn check_no_panic(&self, handler: &str) -> Result<usize, String> {
        let root = self.image.symbol(handler).ok_or_else(|| format!("there is no handler {handler}"))? & !1;
        let mut from: BTreeMap<u32, u32> = BTreeMap::new();
        let mut open = vec![root];
        let mut seen = BTreeSet::from([root]);
        while let Some(address) = open.pop() {
            let way = || {
                let mut way = vec![self.name(address)];
                let mut at = address;
                while let Some(&before) = from.get(&at) {
                    way.push(self.name(before));
                    at = before;
                }
                way.reverse();
                way.join(" → ")
            };
            let Some(facts) = self.facts.get(&address) else {
                return Err(format!("{handler} calls {address:#x}, which is no function: {}", way()));
            };
            if is_panic(self.name(address)) {
                return Err(format!("{handler} can panic: {}", way()));
            }
            if facts.indirect > 0 {
                return Err(format!("{handler} calls through a pointer: {}", way()));
            }
            for &callee in &facts.calls {
                if seen.insert(callee) {
                    from.insert(callee, address);
                    open.push(callee);
                }
            }
        }
        Ok(seen.len())
    }

    /// What a handler can call, by other ways than through functions whose names have one of these fragments, and that
    /// begins within a stretch of memory: names with lengths in bytes.
    pub fn within(&self, handler: &str, exempt: &[&str], memory: &Range<u32>) -> Vec<String> {
        let root = self.image.symbol(handler).unwrap_or_default() & !1;
        let (mut open, mut seen) = (vec![root], BTreeSet::from([root]));
        while let Some(address) = open.pop() {
            for &callee in self.facts.get(&address).map_or(&[][..], |facts| &facts.calls) {
                if !exempt.iter().any(|fragment| self.name(callee).contains(fragment)) && seen.insert(callee) {
                    open.push(callee);
                }
            }
        }
        let inside = seen.into_iter().filter(|address| memory.contains(address));
        let functions = inside.filter_map(|address| self.image.function_at(address));
        functions.map(|function| format!("{} ({} bytes)", function.name, function.range.len())).collect()
    }

    /// The deepest that the stack can get.
    ///
    /// # Errors
    /// Recursion, a stack pointer that moves by a register, a call through a pointer that is not in [`INDIRECT`].
    pub fn stack(&self) -> Result<Stack, String> {
        let (table, length) = self.image.section(".vector_table").ok_or("there is no vector table")?;
        let vector = |n: u32| self.image.word(table + 4 * n).filter(|entry| entry & 1 == 1).map(|entry| entry & !1);
        let mut depths = BTreeMap::new();
        let reset = vector(RESET).ok_or("there is no reset handler")?;
        let thread = self.depth(reset, &mut depths, &mut Vec::new())?;
        let handlers: BTreeSet<u32> = (RESET + 1..length / 4).filter_map(vector).collect();
        let handlers = handlers
            .into_iter()
            .map(|address| {
                let depth = self.depth(address, &mut depths, &mut Vec::new())?;
                Ok((self.name(address).to_owned(), depth + EXCEPTION_FRAME))
            })
            .collect::<Result<_, String>>()?;
        Ok(Stack { thread, handlers })
    }

    fn depth(&self, address: u32, known: &mut BTreeMap<u32, u32>, way: &mut Vec<u32>) -> Result<u32, String> {
        if let Some(&depth) = known.get(&address) {
            return Ok(depth);
        }
        let name = self.name(address);
        if is_panic(name) {
            return Ok(0);
        }
        if way.contains(&address) {
            let names: Vec<&str> = way.iter().map(|&a| self.name(a)).collect();
            return Err(format!("recursion: {} → {name}", names.join(" → ")));
        }
        let Some(facts) = self.facts.get(&address) else {
            let caller = way.last().map_or("the vector table", |&a| self.name(a));
            return Err(format!("{caller} calls {address:#x}, which is no function"));
        };
        if facts.unbounded {
            return Err(format!("{name} moves the stack pointer by a register"));
        }
        way.push(address);
        let mut callees = facts.calls.clone();
        if facts.indirect > 0 {
            let Some((_, fragments)) = INDIRECT.iter().find(|(caller, _)| name.contains(caller)) else {
                let names: Vec<&str> = way.iter().map(|&a| self.name(a)).collect();
                return Err(format!("a call through a pointer that is not listed: {}", names.join(" → ")));
            };
            for fragment in *fragments {
                let matching = self.image.functions.iter().filter(|(_, f)| f.name.contains(fragment));
                callees.extend(matching.map(|(address, _)| *address));
            }
        }
        let mut deepest = 0;
        for callee in callees {
            deepest = deepest.max(self.depth(callee, known, way)?);
        }
        way.pop();
        known.insert(address, facts.stack + deepest);
        Ok(facts.stack + deepest)
    }

    fn name(&self, address: u32) -> &str {
        self.image.function_at(address).map_or("?", |function| &function.name)
    }
}

fn is_panic(name: &str) -> bool {
    PANICS.iter().any(|fragment| name.contains(fragment))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BL_TO_NEXT: [u16; 2] = [0xF000, 0xF800];
    const BX_LR: u16 = 0x4770;

    /// Functions of four bytes or more, one after another from 0x100 on, by name and code.
    fn image(functions: &[(&str, &[u16])]) -> Image {
        let mut at = 0x100;
        let mut placed = Vec::new();
        for (name, code) in functions {
            placed.push((*name, at, code.to_vec()));
            at += 2 * code.len() as u32;
        }
        // The vector table: stack pointer, reset, one handler.
        let reset = placed[0].1 | 1;
        let handler = placed[1].1 | 1;
        Image::of(&placed, &[0x2000_0000, reset, handler])
    }

    #[test]
    fn a_panic_is_found_with_the_way_to_it() {
        let leaf: &[u16] = &[BX_LR];
        let image = image(&[
            ("reset", leaf),
            ("handler", &[BL_TO_NEXT[0], BL_TO_NEXT[1]]),
            ("step", &[0xB510, BL_TO_NEXT[0], BL_TO_NEXT[1]]),
            ("core::panicking::panic_bounds_check", leaf),
        ]);
        let told = Program::new(&image).check_no_panic("handler").unwrap_err();
        assert_eq!(told, "handler can panic: handler → step → core::panicking::panic_bounds_check");
        assert!(Program::new(&image).check_no_panic("nobody").is_err());
    }

    #[test]
    fn a_call_through_a_pointer_is_found() {
        let image = image(&[("reset", &[BX_LR]), ("handler", &[0x4780, BX_LR])]);
        let program = Program::new(&image);
        assert!(program.check_no_panic("handler").unwrap_err().contains("through a pointer"));
        assert!(program.stack().unwrap_err().contains("not listed: handler"));
    }

    #[test]
    fn stacks_add_up_along_the_deepest_way() {
        let image = image(&[
            ("reset", &[0xB510, BL_TO_NEXT[0], BL_TO_NEXT[1]]), // push {r4, lr}; calls what follows
            ("handler", &[0xB084, BX_LR]),                      // sub sp, #16
        ]);
        let program = Program::new(&image);
        assert_eq!(program.check_no_panic("handler"), Ok(1));
        let stack = program.stack().expect("a bound");
        assert_eq!((stack.thread, stack.handlers.clone()), (8 + 16, vec![("handler".to_owned(), 16 + 108)]));
        assert_eq!(stack.bound(), 24 + 124);
    }

    #[test]
    fn what_lies_where_it_should_not_is_found() {
        let image = image(&[
            ("reset", &[BX_LR]),
            ("handler", &[BL_TO_NEXT[0], BL_TO_NEXT[1]]),
            ("step", &[0xB510, BL_TO_NEXT[0], BL_TO_NEXT[1]]),
            ("libm::sinf", &[BX_LR]),
        ]);
        let program = Program::new(&image);
        // By two bytes each: reset at 0x100, handler at 0x102, step at 0x106, sinf at 0x10C.
        assert_eq!(program.within("handler", &[], &(0x108..0x200)), ["libm::sinf (2 bytes)"]);
        assert_eq!(program.within("handler", &[], &(0x100..0x104)), ["handler (4 bytes)"]);
        assert_eq!(program.within("handler", &["step"], &(0x104..0x200)), [""; 0]);
    }

    #[test]
    fn recursion_is_an_error() {
        // bl to itself.
        let image = image(&[("reset", &[0xF7FF, 0xFFFE]), ("handler", &[BX_LR])]);
        assert_eq!(Program::new(&image).stack().unwrap_err(), "recursion: reset → reset");
    }
}
