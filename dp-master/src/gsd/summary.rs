//! A description on one page.

use core::fmt;

use super::check::alarm_pairs;
use super::device::{Gsd, Pins24V, StationType};
use super::module::AlarmKinds;
use crate::time::Baud;

impl Gsd {
    /// The description on one page: who the device is, what it can do, and its modules.
    ///
    /// # Example
    ///
    /// ```
    /// use dp_master::gsd;
    /// let gsd = gsd::parse(b"#Profibus_DP
    /// Vendor_Name = \"V\"
    /// Model_Name = \"M\"
    /// Ident_Number = 0x1234
    /// 1.5M_supp = 1
    /// Module = \"both\" 0x31
    /// EndModule").gsd;
    /// let page = gsd.summary().to_string();
    /// assert!(page.starts_with("V M, ident number 0x1234, slave\n"));
    /// assert!(page.contains("both: 2 in, 2 out (31)"));
    /// ```
    pub fn summary(&self) -> Summary<'_> {
        Summary { gsd: self }
    }
}

/// A description on one page, see [`Gsd::summary`].
#[derive(Debug, Clone, Copy)]
pub struct Summary<'g> {
    gsd: &'g Gsd,
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gsd = self.gsd;
        self.head(f)?;
        self.rates(f)?;
        if gsd.is_slave() {
            self.slave(f)?;
        }
        if gsd.dpv1.dpv1_slave {
            self.dpv1(f)?;
        }
        self.modules(f)
    }
}

impl Summary<'_> {
    fn head(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let general = &self.gsd.general;
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "?".to_owned());
        write!(f, "{} {}", text(&general.vendor_name), text(&general.model_name))?;
        match general.ident_number {
            Some(ident) => write!(f, ", ident number 0x{ident:04X}")?,
            None => write!(f, ", no ident number")?,
        }
        match general.station_type {
            StationType::Slave => writeln!(f, ", slave")?,
            StationType::Master => writeln!(f, ", master")?,
            StationType::Other(other) => writeln!(f, ", station type {other}")?,
        }
        write!(f, "revision {}", text(&general.revision))?;
        write!(f, ", hardware {}", text(&general.hardware_release))?;
        write!(f, ", software {}", text(&general.software_release))?;
        match general.gsd_revision {
            Some(revision) => writeln!(f, ", GSD revision {revision}")?,
            None => writeln!(f)?,
        }
        if let Some(number) = &general.order_number {
            writeln!(f, "order number {number}")?;
        }
        if let Some(info) = &general.info_text {
            writeln!(f, "{info}")?;
        }
        if let Some(family) = &self.gsd.slave.slave_family {
            let names: Vec<&str> = family.sub.iter().map(String::as_str).collect();
            let arrow = if names.is_empty() { "" } else { " > " };
            writeln!(f, "family: {}{arrow}{}", family.main, names.join(" > "))?;
        }
        match general.pins_24v {
            Pins24V::NotConnected => Ok(()),
            Pins24V::Input => writeln!(f, "takes 24 V from the bus connector"),
            Pins24V::Output => writeln!(f, "gives 24 V to the bus connector"),
        }
    }

    fn rates(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let supported = Baud::ALL.into_iter().filter(|&baud| self.gsd.supports(baud));
        let all: Vec<String> = supported
            .map(|baud| format!("{baud} ({})", self.gsd.max_tsdr(baud).0))
            .collect();
        writeln!(f, "baud rates (max Tsdr in tBIT): {}", or_none(&all))
    }

    fn slave(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let slave = &self.gsd.slave;
        let abilities = [
            (slave.freeze_mode_supp, "Freeze"),
            (slave.sync_mode_supp, "Sync"),
            (slave.auto_baud_supp, "finds the baud rate"),
            (slave.set_slave_add_supp, "address over the bus"),
            (slave.fail_safe, "fail safe"),
        ];
        let has: Vec<String> = abilities
            .into_iter()
            .filter(|&(is, _)| is)
            .map(|(_, name)| name.to_owned())
            .collect();
        writeln!(f, "abilities: {}", or_none(&has))?;
        if let Some(interval) = slave.min_slave_intervall {
            let microseconds = u32::from(interval) * 100;
            writeln!(f, "polled at most every {microseconds} µs")?;
        }
        if let Some(len) = slave.max_diag_data_len {
            writeln!(f, "diagnosis: up to {len} octets")?;
        }
        if let Some(len) = self.gsd.prm.len {
            writeln!(f, "user parameters: up to {len} octets")?;
        }
        if slave.modular_station {
            let number = |number: Option<u16>| number.map_or("?".to_owned(), |number| number.to_string());
            writeln!(
                f,
                "modular: up to {} modules, {} octets in, {} out, {} together",
                number(slave.max_module.map(u16::from)),
                number(slave.max_input_len.map(u16::from)),
                number(slave.max_output_len.map(u16::from)),
                number(slave.max_data_len)
            )?;
        }
        Ok(())
    }

    fn dpv1(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let dpv1 = &self.gsd.dpv1;
        let mut has = Vec::new();
        if dpv1.c1_read_write_supp {
            has.push("class 1 read and write".to_owned());
        }
        if dpv1.c2_read_write_supp {
            has.push(match dpv1.c2_max_count_channels {
                Some(count) => format!("class 2 read and write over {count} connections"),
                None => "class 2 read and write".to_owned(),
            });
        }
        for (name, is, _) in alarm_pairs(&dpv1.alarms_supp, &AlarmKinds::default()) {
            if is {
                has.push(format!("{} alarm", name.replace('_', " ").to_lowercase()));
            }
        }
        writeln!(f, "DP-V1: {}", or_none(&has))
    }

    fn modules(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let modules = &self.gsd.modules;
        writeln!(f, "modules: {}", modules.len())?;
        for module in modules {
            let hex: Vec<String> = module.config.iter().map(|octet| format!("{octet:02X}")).collect();
            write!(f, "  {}: ", module.name)?;
            match module.lengths() {
                Ok(lengths) => write!(f, "{} in, {} out", lengths.inputs, lengths.outputs)?,
                Err(_) => write!(f, "no valid identifiers")?,
            }
            writeln!(f, " ({})", hex.join(" "))?;
        }
        for slot in &self.gsd.slots {
            writeln!(
                f,
                "slot {} {}: module {}, allowed {}",
                slot.number, slot.name, slot.default, slot.allowed
            )?;
        }
        Ok(())
    }
}

fn or_none(names: &[String]) -> String {
    match names {
        [] => "none".to_owned(),
        names => names.join(", "),
    }
}
