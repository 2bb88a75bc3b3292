//! What the bytes go over: a serial port, a pseudo-terminal, or a TCP connection to an emulator.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use greyrig::link::BAUD;

/// A read gives up after this time, so that Ctrl-C is noticed.
const PATIENCE: Duration = Duration::from_millis(20);

/// Something that carries bytes both ways.
pub trait Line: Read + Write + Send {}

impl<T: Read + Write + Send> Line for T {}

/// Opens `tcp:HOST:PORT`, or the serial device or pseudo-terminal of that name.
///
/// # Errors
/// What the system says.
pub fn open(name: &str) -> io::Result<Box<dyn Line>> {
    if let Some(address) = name.strip_prefix("tcp:") {
        let stream = TcpStream::connect(address)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        return Ok(Box::new(stream));
    }
    let port = serialport::new(name, BAUD).timeout(PATIENCE).open().map_err(io::Error::from)?;
    Ok(Box::new(port))
}

/// Reads what is there: nothing if the time is up.
///
/// # Errors
/// A line that has gone.
pub fn read(line: &mut dyn Line, bytes: &mut [u8]) -> io::Result<usize> {
    use io::ErrorKind as K;
    match line.read(bytes) {
        Ok(0) => Err(K::UnexpectedEof.into()),
        Err(e) if matches!(e.kind(), K::TimedOut | K::WouldBlock | K::Interrupted) => Ok(0),
        other => other,
    }
}

/// What to do about a line that cannot be opened or has gone.
pub fn remedy(name: &str, error: &io::Error) -> &'static str {
    match error.kind() {
        _ if name.starts_with("tcp:") => "check that the emulator runs and listens there",
        io::ErrorKind::PermissionDenied => "join the group that may use serial ports (often dialout), and log in again",
        io::ErrorKind::NotFound => "check the cable, and the name with `ls /dev/tty*`",
        _ => "check the cable, and that no other program uses the port",
    }
}
