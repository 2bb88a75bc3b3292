//! `greyrig ports`: boards that are connected.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::stdout;
use super::table::{Column, Table};
use super::terminal::Terminal;
use crate::answers::next::CommandLine;
use crate::device::Port;
use crate::device::ports::{self, Answer, Listed, Way};
use crate::error::{EXIT_HARDWARE, Error, Result};

/// Boards that are connected.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig ports\n\n\
    Ports of ST-LINK debug probes are asked who is there. To other ports nothing is sent unless --port names them.\n\
    Exit code: 0 done, 3 a port that was named cannot be opened, or no board answers there.")]
pub struct Args {
    /// A port to ask as well: a serial device, a pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: Vec<String>,
    /// File in which a virtual board publishes its time (`greyrig board --clock`): time-outs of named ports follow it
    #[arg(long, value_name = "FILE", requires = "port")]
    clock: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A system that does not list its ports; an interrupt.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let named: Vec<Port> =
        args.port.iter().map(|name| Port { name: name.clone(), clock: args.clock.clone().into() }).collect();
    let found = ports::find(&named)?;
    let asked: Vec<Listed> = terminal.watching("asking", |ctx| {
        let steps = ctx.steps("asking", found.len() as u64);
        let mut asked = Vec::with_capacity(found.len());
        for port in found {
            asked.push(port.ask(ctx)?);
            steps.next();
        }
        Ok::<_, Error>(asked)
    })?;
    if args.json {
        stdout::print_json("ports", &[], json!({ "ports": asked.iter().map(told).collect::<Vec<_>>() }))?;
    } else if asked.is_empty() {
        stdout::print_line(
            "no serial port is connected; plug in a board, or name a port with --port (a virtual board: greyrig board)",
        )?;
    } else {
        print(&asked)?;
        let board = asked.iter().find(|port| matches!(port.answer, Answer::Board(_)));
        stdout::print_next(board.map(|board| CommandLine::new("rig").option("--port", [&board.name])).as_ref())?;
    }
    let failed = asked.iter().any(|port| port.named && matches!(port.answer, Answer::Nobody(_)));
    Ok(if failed { ExitCode::from(EXIT_HARDWARE) } else { ExitCode::SUCCESS })
}

fn print(ports: &[Listed]) -> Result<()> {
    let mut table = Table::new(["port", "connected", "board", "firmware", "rig", "motor"].map(Column::text));
    for port in ports {
        let mut cells = vec![port.name.clone(), way(&port.way)];
        cells.extend(match &port.answer {
            Answer::NotAsked => ["not asked".into(), String::new(), String::new(), String::new()],
            Answer::Nobody(_) => ["no answer".into(), String::new(), String::new(), String::new()],
            Answer::Board(board) => {
                let or_dash = |name: &Option<String>| name.clone().unwrap_or_else(|| "–".into());
                [board.device.board.clone(), board.device.firmware.clone(), or_dash(&board.rig), or_dash(&board.motor)]
            }
        });
        table.row(cells);
    }
    stdout::print_line(&table.to_string())?;
    for port in ports {
        if let Answer::Nobody(why) = &port.answer {
            eprintln!("greyrig: {}: {why}; {}", port.name, why.remedy());
        }
    }
    if ports.iter().all(|port| matches!(port.answer, Answer::NotAsked)) {
        stdout::print_line("none of them looks like a board of ours; to ask one all the same: --port NAME")?;
    }
    Ok(())
}

/// How a port is connected, in words.
fn way(way: &Way) -> String {
    match way {
        Way::Usb(usb) => {
            let ids = format!("USB {:04x}:{:04x}", usb.vendor_id, usb.product_id);
            let serial = usb.serial.as_ref().map(|serial| format!("serial {serial}"));
            [Some(ids), usb.product.clone(), serial].into_iter().flatten().collect::<Vec<_>>().join(", ")
        }
        Way::Pci => "built in".into(),
        Way::Bluetooth => "Bluetooth".into(),
        Way::Unknown => "–".into(),
    }
}

fn told(port: &Listed) -> serde_json::Value {
    let (board, error) = match &port.answer {
        Answer::NotAsked => (None, None),
        Answer::Board(board) => (Some(board), None),
        Answer::Nobody(why) => (None, Some(json!({ "what": why.to_string(), "remedy": why.remedy() }))),
    };
    json!({
        "port": port.name,
        "connected": port.way,
        "asked": !matches!(port.answer, Answer::NotAsked),
        "device": board.map(|b| &b.device),
        "rig": board.and_then(|b| b.rig.as_ref()),
        "motor": board.and_then(|b| b.motor.as_ref()),
        "error": error,
    })
}
