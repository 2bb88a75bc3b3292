//! Trial run.
use greyrig_board::*;
fn main() {
    let bytes = std::fs::read(std::env::args().nth(1).unwrap()).unwrap();
    let image = Image::parse(&bytes).unwrap();
    for (a, b) in &image.segments { println!("{a:#x} {}", b.len()); }
    let analog = analog::Counts::new(std::iter::repeat([2048, 2048, 100]));
    let mut board = Board::new(&image, Default::default(), Box::new(analog), machine::Pace::ONE).unwrap();
    let t = std::time::Instant::now();
    let seconds: f64 = std::env::args().nth(2).map_or(0.01, |s| s.parse().unwrap());
    let result = board.run(seconds);
    println!("{:?}", result.map_err(|e| e.to_string()));
    println!("{} s virtual in {:?}; pc {:#x}, sequences {}, PA5 {}", board.seconds(), t.elapsed(), board.machine().pc, board.machine().adc.sequences(), board.is_high("PA5"));
}
