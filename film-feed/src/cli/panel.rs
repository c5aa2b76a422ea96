//! `film-feed panel`: the commissioning panel in the browser.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use dp_master::phy::PortName;
use dp_master::time::Baud;

use super::machine;
use super::model::ModelArgs;
use crate::operator::FeedPlan;
use crate::panel::{Access, Machine, Panel, serve};
use crate::real_line::RealLine;
use crate::rig::RigConfig;

/// What `film-feed panel` takes.
#[derive(Debug, Args)]
pub struct PanelArgs {
    /// Address to listen on; another than loopback needs --token.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8930")]
    listen: SocketAddr,
    /// What a page must know to be let in, 16 characters or more of A–Z, a–z, 0–9, - and _: open the page with ?token=….
    #[arg(long, value_name = "SECRET")]
    token: Option<String>,
    /// The machine, as in docs/examples/machine.toml; the axis of the thesis if not given.
    #[arg(long, value_name = "MACHINE.toml")]
    machine: Option<PathBuf>,
    /// Further motors and drives, as in film-feed/catalogue; may be given several times.
    #[arg(long, value_name = "FILE.toml", requires = "machine")]
    catalogue: Vec<PathBuf>,
    /// A real line instead of the simulated machine: a serial device, or tcp://host:port of a serial-device server.
    #[arg(long, value_name = "PATH", conflicts_with_all = ["machine", "fidelity", "film", "gear_stiffness", "seed"])]
    port: Option<PortName>,
    /// Baud rate of that line in bit/s.
    #[arg(long, value_name = "RATE", default_value = "1500000", requires = "port")]
    baud: Baud,
    /// DP address of the drive on that line, 0…125.
    #[arg(long, value_name = "N", default_value_t = 3, requires = "port", value_parser = clap::value_parser!(u8).range(0..=125))]
    address: u8,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    model: ModelArgs,
}

/// Serves until the process is ended.
///
/// # Errors
/// One sentence.
pub fn run(args: &PanelArgs) -> Result<bool, String> {
    let access = Access::new(args.listen, args.token.clone()).map_err(|error| error.to_string())?;
    let (mut rig, plan) = match &args.machine {
        None => {
            let rig = RigConfig {
                seed: args.seed,
                ..RigConfig::default()
            };
            (rig, FeedPlan::default())
        }
        Some(path) => {
            let (machine, _) = machine::read(path, &args.catalogue)?;
            let rig = machine.rig_config(args.seed).map_err(|error| error.to_string())?;
            (rig, machine.feed_plan(1))
        }
    };
    args.model.apply(&mut rig);
    let token = args
        .token
        .as_ref()
        .map_or(String::new(), |token| format!("/?token={token}"));
    let machine = match &args.port {
        None => Machine::Simulated {
            rig: Box::new(rig),
            plan,
        },
        Some(port) => Machine::Real(RealLine {
            port: port.clone(),
            baud: args.baud,
            slave_address: args.address,
            plc_cycle_ns: 5_000_000,
        }),
    };
    serve(Panel { access, machine }, |at| {
        println!("panel at http://{at}{token}; Ctrl-C ends it")
    })
    .map(|()| true)
    .map_err(|error| error.to_string())
}
