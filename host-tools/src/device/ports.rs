//! Which serial ports there are, and which boards answer on them.

use greyrig::parameters::section;
use serde::Serialize;
use serialport::{SerialPortInfo, SerialPortType};

use super::connection::{Connection, Device, Patience, Port};
use super::error::{Error, Result};
use crate::context::Context;

/// STMicroelectronics, as the vendor of a USB device.
const ST: u16 = 0x0483;

/// Products of that vendor that are debug probes with a serial port: ST-LINK/V2-1 in four forms,
/// STLINK-V3 in four, and STLINK-V3PWR. Such a probe is on every NUCLEO board. Source: the table of probes of the crate
/// probe-rs 0.32.
const ST_LINKS: [u16; 9] = [0x3742, 0x374a, 0x374b, 0x3752, 0x374e, 0x374f, 0x3753, 0x3754, 0x3757];

/// How a port is connected.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Way {
    /// Over USB.
    Usb(Usb),
    /// By a board in the computer.
    Pci,
    /// Over Bluetooth.
    Bluetooth,
    /// The system does not tell, or does not list the port: a pseudo-terminal, or a TCP connection.
    Unknown,
}

/// What a USB device says of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Usb {
    /// Number of the vendor.
    pub vendor_id: u16,
    /// The vendor's number of the product.
    pub product_id: u16,
    /// Name of the vendor.
    pub manufacturer: Option<String>,
    /// Name of the product.
    pub product: Option<String>,
    /// Serial number.
    pub serial: Option<String>,
}

impl Usb {
    /// Whether it is a debug probe as it is on the rig's board.
    pub fn is_st_link(&self) -> bool {
        self.vendor_id == ST && ST_LINKS.contains(&self.product_id)
    }
}

/// A board that has answered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Board {
    /// Who it is.
    pub device: Device,
    /// Serial number of its rig, where its parameters name one.
    pub rig: Option<String>,
    /// The motor type that its parameters are of, where they name one.
    pub motor: Option<String>,
}

/// What came of asking.
#[derive(Debug)]
pub enum Answer {
    /// It was not asked: it does not look like a board of ours, and was not named.
    NotAsked,
    /// A board.
    Board(Board),
    /// No board, and why.
    Nobody(Error),
}

/// A port.
#[derive(Debug)]
pub struct Listed {
    /// Its name, as `--port` takes it.
    pub name: String,
    /// How it is connected.
    pub way: Way,
    /// Whether the user has named it.
    pub named: bool,
    /// What came of asking.
    pub answer: Answer,
}

/// A port that has not been asked yet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its name.
    pub name: String,
    /// How it is connected.
    pub way: Way,
    /// The port, if the user has named it.
    pub named: Option<Port>,
}

impl Found {
    /// Asks who is there, where it was named or is a probe as on the rig's board; nothing is sent to others.
    ///
    /// # Errors
    /// An interrupt; all else is the answer.
    pub fn ask(self, ctx: &Context) -> Result<Listed> {
        let Self { name, way, named } = self;
        let looks_like_ours = matches!(&way, Way::Usb(usb) if usb.is_st_link());
        let asked = match &named {
            Some(port) => Some(board(port, Patience::USUAL, ctx)),
            None if looks_like_ours => {
                Some(board(&Port { name: name.clone(), clock: super::clock::Clock::System }, Patience::SHORT, ctx))
            }
            None => None,
        };
        let answer = match asked {
            None => Answer::NotAsked,
            Some(Ok(board)) => Answer::Board(board),
            Some(Err(stop @ Error::Interrupted(_))) => return Err(stop),
            Some(Err(why)) => Answer::Nobody(why),
        };
        Ok(Listed { name, way, named: named.is_some(), answer })
    }
}

/// Who is at a port, and what its parameters are of. Parameters of another layout are not read.
fn board(port: &Port, patience: Patience, ctx: &Context) -> Result<Board> {
    let (mut connection, device) = Connection::open_with(port, patience, ctx)?;
    let settings = section::decode(&connection.read_parameters()?).ok();
    let rig = super::rig::of(&mut connection, settings.as_ref())?;
    let name = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    Ok(Board {
        device,
        rig: rig.as_ref().and_then(|rig| name(&rig.name)),
        motor: settings.as_ref().and_then(|s| name(&s.motor_type)),
    })
}

/// The system's serial ports in the order of their names, and behind them those that were named and that the system
/// does not list.
///
/// # Errors
/// The system does not tell.
pub fn find(named: &[Port]) -> Result<Vec<Found>> {
    Ok(with_named(listed()?, named))
}

fn with_named(mut listed: Vec<SerialPortInfo>, named: &[Port]) -> Vec<Found> {
    listed.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    let mut found: Vec<Found> = listed
        .into_iter()
        .map(|info| Found { named: None, name: info.port_name, way: Way::from(info.port_type) })
        .collect();
    for port in named {
        match found.iter_mut().find(|f| f.name == port.name) {
            Some(known) => known.named = Some(port.clone()),
            None => found.push(Found { name: port.name.clone(), way: Way::Unknown, named: Some(port.clone()) }),
        }
    }
    found
}

/// The system's list. macOS lists each port twice, and the one that waits for a caller, `tty`, is left out.
fn listed() -> Result<Vec<SerialPortInfo>> {
    // Without this folder, as in some containers, the crate would panic.
    if cfg!(target_os = "linux") && !std::path::Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    let mut ports = serialport::available_ports().map_err(|e| Error::NoList(e.into()))?;
    ports.retain(|port| !port.port_name.starts_with("/dev/tty."));
    Ok(ports)
}

impl From<SerialPortType> for Way {
    fn from(port: SerialPortType) -> Self {
        match port {
            SerialPortType::UsbPort(usb) => Self::Usb(Usb {
                vendor_id: usb.vid,
                product_id: usb.pid,
                manufacturer: usb.manufacturer,
                product: usb.product,
                serial: usb.serial_number,
            }),
            SerialPortType::PciPort => Self::Pci,
            SerialPortType::BluetoothPort => Self::Bluetooth,
            SerialPortType::Unknown => Self::Unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use serialport::UsbPortInfo;

    use super::*;

    fn usb(name: &str, vid: u16, pid: u16) -> SerialPortInfo {
        let said = |text: &str| Some(text.to_owned());
        let info = UsbPortInfo {
            interface: None,
            vid,
            pid,
            serial_number: said("066BFF"),
            manufacturer: said("STMicroelectronics"),
            product: said("STM32 STLink"),
        };
        SerialPortInfo { port_name: name.to_owned(), port_type: SerialPortType::UsbPort(info) }
    }

    /// Nothing is opened of what is no probe: the names lead nowhere, and asking one would be an answer.
    #[test]
    fn only_probes_and_named_ports_are_asked() {
        let nowhere = |n: &str| format!("/dev/no-such-port-{n}");
        let listed = vec![
            usb(&nowhere("3"), 0x0483, 0x374e),
            // A serial port that STMicroelectronics' own code makes for anybody's device, and an adapter.
            usb(&nowhere("1"), 0x0483, 0x5740),
            usb(&nowhere("2"), 0x0403, 0x6001),
            SerialPortInfo { port_name: nowhere("0"), port_type: SerialPortType::PciPort },
        ];
        let named = [nowhere("2"), nowhere("9")].map(|name| Port { name, clock: Default::default() });
        let asked = with_named(listed, &named).into_iter().map(|found| {
            let listed = found.ask(&Context::quiet()).unwrap();
            let asked = match &listed.answer {
                Answer::NotAsked => false,
                Answer::Nobody(Error::Closed { .. }) => true,
                other => panic!("{other:?}"),
            };
            (listed.name, listed.named, asked)
        });
        let expected =
            [("0", false, false), ("1", false, false), ("2", true, true), ("3", false, true), ("9", true, true)];
        assert!(asked.eq(expected.map(|(name, named, asked)| (nowhere(name), named, asked))));
    }
}
