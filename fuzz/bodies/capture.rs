//! The reader of captures on any file, and the writer on whatever was read.

use dp_master::phy::{CaptureReader, CaptureWriter, Content};
use dp_master::time::{Baud, Duration};

pub(crate) fn run(data: &[u8]) {
    let Ok(mut reader) = CaptureReader::new(data) else {
        return;
    };
    let mut copy = CaptureWriter::new(Vec::new(), Baud::B1500000, Duration::ZERO).unwrap();
    let mut written = Vec::new();
    let mut failed = false;
    for packet in reader.by_ref() {
        assert!(!failed, "a packet after an error");
        let Ok(packet) = packet else {
            failed = true;
            continue;
        };
        assert!(packet.octets.len() <= data.len());
        let _ = packet.telegram();
        let trace = packet.trace(Baud::B1500000);
        copy.write(&trace).unwrap();
        // A telegram that is whole has lost nothing, whatever length a file claims for it.
        let lost = match trace.content {
            Content::Telegram(_) => 0,
            Content::Discarded { lost, .. } => lost,
        };
        written.push((packet.start, packet.octets.clone(), lost));
    }
    let _ = reader.baud();
    // What was read and written is read again.
    let copy = copy.finish().unwrap();
    let again: Vec<_> = CaptureReader::new(copy.as_slice())
        .unwrap()
        .map(|packet| packet.map(|packet| (packet.start, packet.octets, packet.lost)).unwrap())
        .collect();
    assert_eq!(again, written);
}
