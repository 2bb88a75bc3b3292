//! Functions, sections and bytes of an ELF file.

use std::collections::BTreeMap;
use std::ops::Range;

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind};

/// An image.
pub struct Image {
    /// Functions by address.
    pub functions: BTreeMap<u32, Function>,
    /// Sections that take memory: name, address, length.
    pub sections: Vec<(String, u32, u32)>,
    contents: Vec<(u32, Vec<u8>)>,
    symbols: BTreeMap<String, u32>,
}

/// A function with its code; literal pools and jump tables are left out.
pub struct Function {
    /// Demangled, without the hash.
    pub name: String,
    /// Addresses, literal pools included.
    pub range: Range<u32>,
    /// Stretches of instructions: address, halfwords.
    pub code: Vec<(u32, Vec<u16>)>,
}

impl Image {
    /// Reads a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let file = object::File::parse(bytes).map_err(|e| format!("not an ELF file: {e}"))?;
        let mut contents = Vec::new();
        let mut sections = Vec::new();
        for section in file.sections() {
            let (name, address) = (section.name().unwrap_or_default().to_owned(), section.address() as u32);
            // SHF_ALLOC. `.defmt` holds texts for the host and takes no memory, whatever it says.
            let takes_memory = matches!(section.flags(), SectionFlags::Elf { sh_flags, .. } if sh_flags.0 & 2 != 0);
            if takes_memory && section.size() > 0 && name != ".defmt" {
                sections.push((name, address, section.size() as u32));
                if let Ok(data) = section.data()
                    && !data.is_empty()
                {
                    contents.push((address, data.to_vec()));
                }
            }
        }
        // Mapping symbols: where code ($t) and data ($d) begin (Arm ELF for the Arm architecture, section 5.5.5).
        let mut maps: BTreeMap<u32, bool> = BTreeMap::new();
        let mut symbols = BTreeMap::new();
        let mut functions = BTreeMap::new();
        for symbol in file.symbols() {
            let (Ok(name), address) = (symbol.name(), symbol.address() as u32) else { continue };
            match name {
                _ if name == "$t" || name.starts_with("$t.") => {
                    maps.insert(address, true);
                }
                _ if name == "$d" || name.starts_with("$d.") => {
                    maps.insert(address, false);
                }
                _ if symbol.kind() == SymbolKind::Text && symbol.size() > 0 => {
                    let begin = address & !1;
                    let range = begin..begin + symbol.size() as u32;
                    symbols.insert(name.to_owned(), begin);
                    let name = format!("{:#}", rustc_demangle::demangle(name));
                    functions.insert(begin, Function { name, range, code: Vec::new() });
                }
                _ => {
                    symbols.insert(name.to_owned(), address);
                }
            }
        }
        let mut image = Self { functions: BTreeMap::new(), sections, contents, symbols };
        for (begin, mut function) in functions {
            function.code = image.code(&function.range, &maps);
            image.functions.insert(begin, function);
        }
        Ok(image)
    }

    /// A word of memory.
    pub fn word(&self, address: u32) -> Option<u32> {
        let bytes = self.bytes(address..address + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    }

    /// A section's address and length.
    pub fn section(&self, name: &str) -> Option<(u32, u32)> {
        self.sections.iter().find(|(n, ..)| n == name).map(|(_, address, length)| (*address, *length))
    }

    /// The value of a symbol that is no function, or the address of one that is.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).copied()
    }

    /// The function at an address, whose lowest bit says "Thumb".
    pub fn function_at(&self, address: u32) -> Option<&Function> {
        self.functions.get(&(address & !1))
    }

    /// An image of functions (name, address, code) and a vector table at zero.
    #[cfg(test)]
    pub fn of(functions: &[(&str, u32, Vec<u16>)], vectors: &[u32]) -> Self {
        let table: Vec<u8> = vectors.iter().flat_map(|word| word.to_le_bytes()).collect();
        Self {
            functions: functions
                .iter()
                .map(|(name, at, code)| {
                    let range = *at..at + 2 * code.len() as u32;
                    (*at, Function { name: (*name).to_owned(), range, code: vec![(*at, code.clone())] })
                })
                .collect(),
            sections: vec![(".vector_table".to_owned(), 0, table.len() as u32)],
            contents: vec![(0, table)],
            symbols: functions.iter().map(|(name, at, _)| ((*name).to_owned(), *at)).collect(),
        }
    }

    fn bytes(&self, range: Range<u32>) -> Option<&[u8]> {
        self.contents.iter().find_map(|(begin, bytes)| {
            let from = range.start.checked_sub(*begin)? as usize;
            bytes.get(from..from + range.len())
        })
    }

    fn code(&self, range: &Range<u32>, maps: &BTreeMap<u32, bool>) -> Vec<(u32, Vec<u16>)> {
        let mut is_code = maps.range(..=range.start).next_back().is_none_or(|(_, code)| *code);
        let mut begin = range.start;
        let mut stretches = Vec::new();
        let ends = maps.range(range.start + 1..range.end).map(|(a, c)| (*a, *c)).chain([(range.end, false)]);
        for (end, next_is_code) in ends {
            if is_code && let Some(bytes) = self.bytes(begin..end) {
                let halfwords = bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
                stretches.push((begin, halfwords));
            }
            (begin, is_code) = (end, next_is_code);
        }
        stretches
    }
}
