//! Prints what a DP cycle takes on the line beside the least it could take, for both masters.
//!
//! Virtual time, so the same on every machine: `cargo run -p peers --bin bus-time`.

fn main() {
    println!("1.5 Mbit/s, slaves with 16 octets in and 16 out; ideal: request, Tsdr 11, reply, Tsyn 33 tBIT for each");
    println!("slaves  ideal µs    ours µs  ratio    profirust µs  ratio");
    for slaves in [1, 30] {
        let (ours, peers) = (peers::bus_time::ours(slaves), peers::bus_time::peers(slaves));
        let micros = |span: dp_master::time::Duration| span.as_nanos() as f64 / 1e3;
        println!(
            "{slaves:6} {:9.1} {:10.1} {:6.3} {:15.1} {:6.3}",
            micros(ours.ideal),
            micros(ours.cycle),
            ours.ratio(),
            micros(peers.cycle),
            peers.ratio()
        );
    }
}
