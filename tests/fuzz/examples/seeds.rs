//! Seeds of the targets whose formats are greyrig's own: `cargo run --package greyrig-fuzz --example seeds`.

use std::path::Path;

use greyrig::app::bench;
use greyrig::link::frame::{MAX_FRAME, encode};
use greyrig::link::message::{Asked, Message, Reply, Request, Samples};
use greyrig::link::packing;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::section;
use greyrig::units::Counts;
use greyrig_host::device::parameters;
use greyrig_host::model::Model;

fn put(target: &str, name: &str, content: &[u8]) -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join(name), content)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/model");
    let mut payloads = Vec::new();
    for entry in std::fs::read_dir(models)? {
        let path = entry?.path();
        let settings = parameters::settings(&Model::load(&path)?, &path)?;
        let mut buffer = [0; MAX_PAYLOAD];
        let payload = section::encode(&settings, &mut buffer)?.to_vec();
        put("section", &path.file_stem().unwrap_or_default().to_string_lossy(), &payload)?;
        payloads.push(payload);
    }

    let mut bench = bench::Bench::new()?;
    let counts: Vec<Counts> = (0..packing::SAMPLES).map(|_| bench.counts()).collect();
    let packed = packing::pack(&counts);
    let samples = |first| Message::Samples(Samples { first, count: counts.len() as u8, packed: &packed });
    let mut messages = Vec::new();
    for message in
        [samples(10), samples(74), Message::Reply { number: 1, reply: Reply::Done }, samples(300), samples(11)]
    {
        messages.extend_from_slice(postcard::to_slice(&message, &mut [0; 512])?);
    }
    put("message", "capture", &messages)?;

    let (mut frames, mut bodies) = (Vec::new(), Vec::new());
    let requests = [
        Request::Hello,
        Request::Status,
        Request::ReadParameters { offset: 0 },
        Request::StartTelemetry { every: 10 },
        Request::StartCapture,
        Request::BeginTest { test: 1 },
        Request::ClearFaults,
        Request::Stop,
        Request::Restart,
    ];
    for (number, request) in (0..).zip(requests) {
        let mut frame = [0; MAX_FRAME];
        let asked = Asked { number, request };
        let length = encode(&asked, &mut frame).map_err(|e| format!("{e:?}"))?;
        frames.extend_from_slice(&frame[..length]);
        let mut body = [0; 64];
        let body = postcard::to_slice(&asked, &mut body)?;
        bodies.extend_from_slice(&[b'f', body.len() as u8]);
        bodies.extend_from_slice(body);
        // Samples after each request.
        bodies.extend_from_slice(b"s\xff\x00\x08\x00\x08\x10\x00");
    }
    put("frame", "requests", &frames)?;
    put("server", "unconfigured", &bodies)?;
    for (name, payload) in ["first", "second", "third"].iter().zip(&payloads) {
        let [low, high] = (payload.len() as u16).to_le_bytes();
        let write = [&[b'p', low, high], payload.as_slice()].concat();
        // Written, started, asked all; then a write that is cut, and another start.
        put("server", name, &[&write, b"r".as_slice(), &bodies, b"c\x05\x01", &write, b"r", &bodies].concat())?;
    }
    Ok(())
}
