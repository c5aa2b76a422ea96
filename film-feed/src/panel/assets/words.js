// English and German. Names of the original block stay as they are.

import { GERMAN } from "./german.js";

const WORDS = {
  en: {
    skip: "To the view", title: "Film feed", real_machine: "real machine", machine_time: "Machine time", speed: "Speed", pause: "Pause", step: "Step 5 ms",
    factor: "Speed factor", language: "Language", take_control: "Take control", release_control: "Release control",
    control_yours: "You have the control.", control_other: "Another page has the control; you can look.", control_free: "Nobody has the control.",
    lost: "The connection is lost; reload the page when the program runs again.",
    machine: "Machine", variables: "Variables", scope: "Oscilloscope", drive: "Drive", parameters: "Parameter channel", bus: "Bus",
    start_feed: "Start a feed", enable: "Enable", to_mark: "Feed to the print mark", film: "Film", feeds: "Last feeds", error_band: "Error in µm against the band of ±10 µm",
    no_feed: "No feed yet.", reader: "Reader", roller: "Roller", tool: "Tool", film_position: "Film position", film_speed: "Film speed", disturb: "Disturb the machine",
    no_print: "Thread film without print", print: "Thread printed film", mains_off: "Mains off", mains_on: "Mains on", guard: "Open the guard (terminal 28)", load: "Load torque in Nm", set: "Set",
    name: "Name", original: "Original", value: "Value", unit: "Unit", range: "Range", inputs: "Inputs of the block", outputs: "Outputs of the block",
    signals: "Signals", trigger: "Trigger", trigger_off: "Off", rising: "rising", falling: "falling", level: "Level", pre_trigger: "Pre-trigger in %", window: "Time window in s",
    hold: "Hold", cursors: "Cursors", difference: "Difference", figure_73: "Figure 73", zoom_hint: "The wheel zooms about the pointer, + and − about the chosen cursor; arrow keys move it, with Shift the window; a and b choose.", cursor_a: "Cursor A", cursor_b: "Cursor B",
    no_loss: "no sample lost", loss: "samples lost", state: "State of the profile", control_word: "Control word", status_word: "Status word", fault: "Fault", none: "none",
    remedy: "Remedy", history: "Fault memory", reset: "Reset the fault", cause_fault: "Cause a fault", cause: "Cause", clear: "Clear", codes: "Codes", read: "Read", write: "Write", code: "Code", meaning: "Meaning",
    net: "Net of the parameter channel", telegram: "Telegram at work", sent: "Sent", received: "Received", rounds: "Rounds", round_time: "Time of a round in ms", troubles: "Refused or unanswered",
    slave: "Slave", cycle: "DP cycle in µs", telegrams: "Telegrams", retries: "Repetitions", baud: "Baud rate in kbit/s", noise: "Bit error rate", unplug: "Unplug the module", second_master: "Second master", held: "held back while", by: "by", live: "Telegrams, newest first", time: "Time in s", octets: "Octets",
    views: "Views", film_picture: "Film, reader, roller and tool", feeds_picture: "Errors of the last feeds", diagram: "State diagram of the profile", curves: "Curves of the oscilloscope", edge: "Edge", net_picture: "Petri net of the parameter channel",
    blank_mark: "Blank the next mark", advice: "Advice for these values", advice_none: "Nothing goes wrong by these values alone.", hazards: "What goes wrong when something else happens", disturb_line: "Disturb the line",
    stations: "Live list", ask_all: "Ask all addresses", asking: "asking …", address: "Address", station: "Station", live_none: "Not asked yet.", zoom_in: "Closer", zoom_out: "Wider", zoom_all: "Whole window", any_state: "any state",
    asked: "commanded now",
    error: "Error in µm", number: "No.", mode: "Mode", length: "length", mark: "mark", duration: "Time in s", refused_from: "From here lead", diagnosis: "Diagnosis C0183", record: "Record", current: "Motor current", link: "DC link", heat: "Heat sink",
  },
  de: {
    skip: "Zur Ansicht", title: "Folienvorzug", real_machine: "echte Maschine", machine_time: "Maschinenzeit", speed: "Tempo", pause: "Pause", step: "Schritt 5 ms",
    factor: "Zeitfaktor", language: "Sprache", take_control: "Bedienung übernehmen", release_control: "Bedienung abgeben",
    control_yours: "Sie bedienen.", control_other: "Eine andere Seite bedient; Sie sehen zu.", control_free: "Niemand bedient.",
    lost: "Die Verbindung ist unterbrochen; laden Sie die Seite neu, wenn das Programm wieder läuft.",
    machine: "Maschine", variables: "Variablen", scope: "Oszilloskop", drive: "Antrieb", parameters: "Parameterkanal", bus: "Bus",
    start_feed: "Vorzug starten", enable: "Freigabe", to_mark: "Auf Druckmarke fahren", film: "Folie", feeds: "Letzte Vorzüge", error_band: "Fehler in µm gegen das Band von ±10 µm",
    no_feed: "Noch kein Vorzug.", reader: "Leser", roller: "Vorzugwelle", tool: "Werkzeug", film_position: "Folienweg", film_speed: "Foliengeschwindigkeit", disturb: "Maschine stören",
    no_print: "Unbedruckte Folie einlegen", print: "Bedruckte Folie einlegen", mains_off: "Netz aus", mains_on: "Netz ein", guard: "Schutztür öffnen (Klemme 28)", load: "Lastmoment in Nm", set: "Setzen",
    name: "Name", original: "Original", value: "Wert", unit: "Einheit", range: "Bereich", inputs: "Eingänge des Bausteins", outputs: "Ausgänge des Bausteins",
    signals: "Signale", trigger: "Trigger", trigger_off: "Aus", rising: "steigend", falling: "fallend", level: "Pegel", pre_trigger: "Vorgeschichte in %", window: "Zeitfenster in s",
    hold: "Anhalten", cursors: "Cursor", difference: "Differenz", figure_73: "Bild 73", zoom_hint: "Das Rad zoomt um den Zeiger, + und − um den gewählten Cursor; Pfeiltasten bewegen ihn, mit Umschalt das Fenster; a und b wählen.", cursor_a: "Cursor A", cursor_b: "Cursor B",
    no_loss: "kein Wert verloren", loss: "Werte verloren", state: "Zustand nach Profil", control_word: "Steuerwort", status_word: "Statuswort", fault: "Störung", none: "keine",
    remedy: "Abhilfe", history: "Fehlerspeicher", reset: "Störung quittieren", cause_fault: "Störung auslösen", cause: "Auslösen", clear: "Aufheben", codes: "Codestellen", read: "Lesen", write: "Schreiben", code: "Code", meaning: "Bedeutung",
    net: "Netz des Parameterkanals", telegram: "Telegramm in Arbeit", sent: "Gesendet", received: "Empfangen", rounds: "Runden", round_time: "Zeit einer Runde in ms", troubles: "Abgelehnt oder unbeantwortet",
    slave: "Slave", cycle: "DP-Zyklus in µs", telegrams: "Telegramme", retries: "Wiederholungen", baud: "Baudrate in kbit/s", noise: "Bitfehlerrate", unplug: "Modul abziehen", second_master: "Zweiter Master", held: "gehalten, solange", by: "durch", live: "Telegramme, neueste zuerst", time: "Zeit in s", octets: "Oktette",
    views: "Ansichten", film_picture: "Folie, Leser, Vorzugwelle und Werkzeug", feeds_picture: "Fehler der letzten Vorzüge", diagram: "Zustandsdiagramm des Profils", curves: "Kurven des Oszilloskops", edge: "Flanke", net_picture: "Petrinetz des Parameterkanals",
    blank_mark: "Nächste Marke nicht drucken", advice: "Rat zu diesen Werten", advice_none: "Mit diesen Werten allein geht nichts schief.", hazards: "Was schiefgeht, wenn etwas dazukommt", disturb_line: "Leitung stören",
    stations: "Lebensliste", ask_all: "Alle Adressen fragen", asking: "fragt …", address: "Adresse", station: "Station", live_none: "Noch nicht gefragt.", zoom_in: "Näher", zoom_out: "Weiter", zoom_all: "Ganzes Fenster", any_state: "jeder Zustand",
    asked: "jetzt befohlen",
    error: "Fehler in µm", number: "Nr.", mode: "Art", length: "Länge", mark: "Marke", duration: "Zeit in s", refused_from: "Von hier führen", diagnosis: "Diagnose C0183", record: "Satz", current: "Motorstrom", link: "Zwischenkreis", heat: "Kühlkörper",
  },
};

let language = "en";

export function word(key) {
  return WORDS[language][key] ?? WORDS.en[key] ?? key;
}

/// A text that the program sent, in the language of the page.
export function phrase(text) {
  return (language === "de" && GERMAN[text]) || text;
}

/// Puts all marked texts of the page into a language.
export function speak(chosen) {
  language = chosen;
  document.documentElement.lang = chosen;
  document.title = word("title");
  for (const element of document.querySelectorAll("[data-word]")) {
    element.textContent = word(element.dataset.word);
  }
  for (const element of document.querySelectorAll("[data-phrase]")) {
    element.textContent = phrase(element.dataset.phrase);
  }
  for (const element of document.querySelectorAll("[data-label]")) {
    element.setAttribute("aria-label", word(element.dataset.label));
  }
}
