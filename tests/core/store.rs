//! The two slots: the old block or the new one, whenever the power fails.

use greyrig::hardware::{NUCLEO_G474RE, Slots};
use greyrig::parameters::block::{HEADER, Header, MAX_PAYLOAD, NoBlock, SLOTS};
use greyrig::parameters::store::{Store, WriteError};

use crate::nor::{Cut, Nor};

/// A page that is none of the store's, so that an offset that is ignored shows.
const BASE: u32 = 2048;
/// A page.
const SLOT_SIZE: usize = 2048;

fn store(nor: Nor) -> Store<Nor> {
    Store::new(nor, BASE, SLOT_SIZE)
}

fn flash() -> Nor {
    Nor::erased(1 + SLOTS)
}

/// Payloads that differ in length and in every byte.
fn payload(n: usize) -> Vec<u8> {
    (0..200 + 37 * n).map(|k| (k * 7 + n * 13) as u8).collect()
}

fn written(nor: Nor, payload: &[u8]) -> Nor {
    let mut store = store(nor);
    store.write(payload, &mut [0; MAX_PAYLOAD]).expect("it is written");
    store.into_flash()
}

fn loaded(nor: &Nor) -> Option<(usize, u32, Vec<u8>)> {
    let mut bytes = [0; MAX_PAYLOAD];
    let (slot, header) = store(nor.clone()).load(&mut bytes)?;
    Some((slot, header.sequence, bytes[..usize::from(header.length)].to_vec()))
}

#[test]
fn an_empty_flash_has_no_block() {
    assert_eq!(loaded(&flash()), None);
    assert_eq!(store(flash()).read(0, &mut [0; MAX_PAYLOAD]), Err(NoBlock::Erased));
}

#[test]
fn blocks_are_written_in_turn() {
    let mut nor = flash();
    for n in 0..5 {
        nor = written(nor, &payload(n));
        assert_eq!(loaded(&nor), Some((n % 2, n as u32 + 1, payload(n))));
    }
    let mut first_page = [0; 8];
    embedded_storage::nor_flash::ReadNorFlash::read(&mut nor, BASE - 8, &mut first_page).unwrap();
    assert_eq!(first_page, [0xFF; 8], "the page before the slots is untouched");
}

/// The sweep: every write and every erasure is cut before, within and after, from every number of blocks written
/// before; then the interrupted write is repeated on what the cut has left.
#[test]
fn every_power_cut_leaves_the_old_or_the_new_block() {
    let mut cuts = 0;
    for before in 0..3 {
        let nor = (0..before).fold(flash(), |nor, n| written(nor, &payload(n)));
        let old = loaded(&nor);
        let (new, after) = (payload(before), payload(before + 1));
        let operations = written(nor.clone().cut_at(usize::MAX, Cut::Before), &new).operations;
        // An erasure, the payload, two halves of the header.
        assert_eq!(operations, 1 + new.len().div_ceil(8) + 2);
        for operation in 0..operations {
            for cut in [Cut::Before, Cut::Within, Cut::After] {
                let mut store = store(nor.clone().cut_at(operation, cut));
                assert_eq!(store.write(&new, &mut [0; MAX_PAYLOAD]), Err(WriteError::Flash));
                let left = store.into_flash().powered();
                let found = loaded(&left);
                let last = operation + 1 == operations && cut == Cut::After;
                if last {
                    assert_eq!(found.as_ref().map(|f| &f.2), Some(&new));
                } else {
                    assert_eq!(found, old, "cut {cut:?} at operation {operation}");
                }
                let again = loaded(&written(left, &after)).expect("a block");
                assert_eq!(again.2, after, "written again after the cut {cut:?} at operation {operation}");
                cuts += 1;
            }
        }
    }
    assert!(cuts > 200, "{cuts} cuts");
}

/// Two cuts in a row: whatever the first has left, the second write is cut too, everywhere. The block of before stays
/// until a newer one is whole, and a third write succeeds.
#[test]
fn a_second_power_cut_leaves_a_block_too() {
    let mut pairs = 0;
    for before in 0..3 {
        let nor = (0..before).fold(flash(), |nor, n| written(nor, &payload(n)));
        let (first, second, third) = (payload(before), payload(before + 1), payload(before + 2));
        let cuts = |nor: &Nor, payload: &[u8]| {
            let operations = written(nor.clone().cut_at(usize::MAX, Cut::Before), payload).operations;
            (0..operations).flat_map(|operation| [Cut::Before, Cut::Within, Cut::After].map(|cut| (operation, cut)))
        };
        let cut = |nor: &Nor, payload: &[u8], (operation, cut): (usize, Cut)| {
            let mut store = store(nor.clone().cut_at(operation, cut));
            assert_eq!(store.write(payload, &mut [0; MAX_PAYLOAD]), Err(WriteError::Flash));
            store.into_flash().powered()
        };
        for one in cuts(&nor, &first) {
            let left = cut(&nor, &first, one);
            let old = loaded(&left);
            for two in cuts(&left, &second) {
                let left = cut(&left, &second, two);
                let found = loaded(&left);
                let is_new = found.as_ref().is_some_and(|(_, _, payload)| *payload == second);
                assert!(is_new || found == old, "cut {one:?}, then {two:?}");
                assert_eq!(loaded(&written(left, &third)).map(|(.., payload)| payload).as_ref(), Some(&third));
                pairs += 1;
            }
        }
    }
    assert!(pairs > 20_000, "{pairs} pairs of cuts");
}

#[test]
fn a_damaged_new_block_gives_way_to_the_old_one() {
    let nor = written(written(flash(), &payload(0)), &payload(1));
    let second = BASE as usize + SLOT_SIZE;
    for offset in 0..HEADER + payload(1).len() {
        let mut damaged = nor.clone();
        damaged.flip(second + offset, (offset % 8) as u8);
        assert_eq!(loaded(&damaged), Some((0, 1, payload(0))), "a bit of byte {offset}");
        let mut damaged = nor.clone();
        damaged.poison(second + offset);
        assert_eq!(loaded(&damaged), Some((0, 1, payload(0))), "the word of byte {offset}");
    }
}

#[test]
fn sequence_numbers_wrap() {
    use embedded_storage::nor_flash::NorFlash;
    let mut nor = flash();
    for (slot, sequence) in [(0, u32::MAX), (1, u32::MAX - 1)] {
        let start = BASE + (slot * SLOT_SIZE) as u32;
        nor.write(start, &Header::seal(sequence, &[]).to_bytes()).unwrap();
    }
    assert_eq!(loaded(&nor), Some((0, u32::MAX, vec![])));
    let nor = written(nor, &payload(0));
    assert_eq!(loaded(&nor), Some((1, 0, payload(0))));
    assert_eq!(loaded(&written(nor, &payload(1))), Some((0, 1, payload(1))));
}

#[test]
fn the_longest_payload_fits_and_a_longer_one_is_refused() {
    let longest = vec![0; MAX_PAYLOAD];
    assert_eq!(loaded(&written(flash(), &longest)), Some((0, 1, longest)));
    let result = store(flash()).write(&[0; MAX_PAYLOAD + 1], &mut [0; MAX_PAYLOAD]);
    assert_eq!(result, Err(WriteError::TooLong));
}

/// A slot of two pages, as a board with smaller pages has it: both are erased before they are written again.
#[test]
fn a_slot_of_several_pages_is_erased_as_a_whole() {
    let store = |nor: Nor| Store::new(nor, 0, 2 * SLOT_SIZE);
    let mut nor = Nor::erased(2 * SLOTS);
    for n in 0..5 {
        let mut one = store(nor);
        let (slot, header) = one.write(&payload(n), &mut [0; MAX_PAYLOAD]).expect("it is written");
        assert_eq!((slot, header.sequence), (n % 2, 1 + n as u32));
        let mut found = [0; MAX_PAYLOAD];
        assert_eq!(one.load(&mut found), Some((slot, header)));
        assert!(found.starts_with(&payload(n)));
        nor = one.into_flash();
    }
}

/// The linker's map keeps the program away from where the slots are.
#[test]
fn memory_map_and_constants_agree() {
    let map = include_str!("../../memory.x");
    let region = |name: &str| {
        let line = map.lines().find(|line| line.trim_start().starts_with(name)).expect("a line of the map");
        let number = |key: &str| {
            let text = line.split(key).nth(1).and_then(|rest| rest.split('=').nth(1)).expect("a number");
            let text = text.rsplit(':').next().unwrap_or(text).trim();
            let text = text.split([',', ' ']).next().expect("digits");
            match (text.strip_prefix("0x"), text.strip_suffix('K')) {
                (Some(hexadecimal), _) => u32::from_str_radix(hexadecimal, 16).expect("hexadecimal"),
                (_, Some(kibi)) => 1024 * kibi.parse::<u32>().expect("a number"),
                _ => text.parse().expect("a number"),
            }
        };
        (number("ORIGIN"), number("LENGTH"))
    };
    let Slots { address, size } = NUCLEO_G474RE.slots;
    let rig = NUCLEO_G474RE.rig;
    let length = (SLOTS * (rig.size + size)) as u32;
    assert_eq!(region("PARAMS"), (rig.address, length));
    assert_eq!(rig.address + (SLOTS * rig.size) as u32, address, "one behind the other");
    // The end of 512 KiB of flash (STM32G474xE).
    assert_eq!(address + (SLOTS * size) as u32, 0x0808_0000);
    // Bank 1 alone.
    for name in ["FLASH", "HOT"] {
        let (start, length) = region(name);
        assert!(start + length <= 0x0804_0000, "{name}: {start:#x} + {length:#x}");
    }
}
