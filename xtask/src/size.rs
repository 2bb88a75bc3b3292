//! `cargo xtask size`.
use crate::firmware::{elf::Image, report::Program};
pub fn try_it(path: &str) {
    let image = Image::parse(&std::fs::read(path).unwrap()).unwrap();
    for s in &image.sections {
        println!("{s:x?}");
    }
    let p = Program::new(&image);
    println!("{:?}", p.check_no_panic(if path.contains("nucleo") { "ADC1_2" } else { "SysTick" }));
    println!("{:#?}", p.stack());
}
