//! How closely the machine is modelled, as the command line takes it.

use clap::{Args, ValueEnum};
use lenze9300_model::plant::{Coupling, Fidelity};

use crate::machine::WebParams;
use crate::rig::RigConfig;

/// What of the machine is not ideal.
#[derive(Debug, Clone, Args)]
pub(super) struct ModelArgs {
    /// How closely inverter and measurements are modelled: f0 kinematic, f1 averaged, f2 with errors, f3 switched.
    #[arg(long, value_name = "LEVEL", default_value_t = Fidelity::Averaged)]
    fidelity: Fidelity,
    /// The film: rigid, or elastic between a braked roll and the roller.
    #[arg(long, value_enum, default_value_t = FilmChoice::Rigid)]
    film: FilmChoice,
    /// Stiffness of the gear with its shafts at the output, 10…1000000 Nm/rad; rigid if not given.
    #[arg(long, value_name = "NM_PER_RAD", value_parser = parse_stiffness)]
    gear_stiffness: Option<f64>,
    /// Free play of the gear at its output, 0…60 arc minutes.
    #[arg(long, value_name = "ARCMIN", value_parser = parse_backlash, requires = "gear_stiffness")]
    backlash: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FilmChoice {
    /// Goes with the roller.
    Rigid,
    /// Stretches, swings with the roll, runs slack, slips.
    Elastic,
}

impl ModelArgs {
    /// Puts the choices into the parts of the chain.
    pub(super) fn apply(&self, config: &mut RigConfig) {
        let axis = &mut config.drive.axis;
        axis.fidelity = self.fidelity;
        // A machine file may have a coupling and a film of its own.
        if let Some(stiffness) = self.gear_stiffness {
            let ratio = config.film.roller.gear_ratio;
            let coupling = Coupling::at_gear_output(stiffness, self.backlash.unwrap_or(0.0), ratio);
            axis.mechanics.coupling = Some(coupling);
        }
        if self.film == FilmChoice::Elastic {
            config.film.web = Some(WebParams::default());
        }
    }
}

fn parse_stiffness(text: &str) -> Result<f64, String> {
    parse_within(text, 10.0, 1e6, "Nm/rad")
}

fn parse_backlash(text: &str) -> Result<f64, String> {
    parse_within(text, 0.0, 60.0, "arc minutes")
}

fn parse_within(text: &str, min: f64, max: f64, unit: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|value| (min..=max).contains(value))
        .ok_or_else(|| format!("allowed is {min}…{max} {unit}"))
}
