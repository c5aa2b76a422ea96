//! The GSD reader on any text.

use dp_master::gsd::{Severity, parse};

/// Most remarks of a reading, and the one that tells how many were left out.
const MOST_REMARKS: usize = 1_001;

pub(crate) fn run(data: &[u8]) {
    let reading = parse(data);
    assert!(reading.diagnostics.len() <= MOST_REMARKS);
    // A line ends with CR, LF or both, so there are no more lines than this.
    let lines = 1 + data.iter().filter(|octet| matches!(octet, b'\r' | b'\n')).count();
    let mut before = 0;
    for remark in &reading.diagnostics {
        assert!(remark.line() as usize <= lines, "{remark}");
        assert!(remark.line() >= before, "{remark}: out of order");
        before = remark.line();
        assert!(!remark.to_string().is_empty());
        let _ = remark.severity == Severity::Error;
    }
    for module in &reading.gsd.modules {
        let _ = module.lengths();
    }
    for parameter in reading.gsd.parameters.values() {
        let kind = parameter.data_type;
        let mut octets = [0; 8];
        for value in [*kind.range().start(), 0, *kind.range().end()] {
            if kind.range().contains(&value) && kind.write(value, &mut octets, 1) {
                assert_eq!(kind.read(&octets, 1), Some(value));
            }
            let _ = parameter.allows(value);
            let _ = reading.gsd.text_of(parameter, value);
        }
    }
}
