// German for the texts that the program sends: states and commands of the profile, faults, signals, stations. A text that is not here
// stays English; a test looks that none is missing.

export const GERMAN = {
  // States.
  "not ready to switch on": "nicht einschaltbereit", "switch-on disabled": "Einschaltsperre", "ready to switch on": "einschaltbereit",
  "switched on": "eingeschaltet", "operation enabled": "Betrieb freigegeben", "quick stop active": "Schnellhalt aktiv",
  "fault reaction active": "Störungsreaktion aktiv", "fault": "Störung", "unknown": "unbekannt",
  // Commands and events.
  "shutdown": "Stillsetzen", "switch on": "Einschalten", "enable operation": "Betrieb freigeben", "inhibit operation": "Betrieb sperren",
  "quick stop": "Schnellhalt", "disable voltage": "Spannung sperren", "reset fault": "Störung rücksetzen", "power on": "Netz ein",
  "self test done": "Selbsttest beendet", "reaction finished": "Reaktion beendet", "standstill reached": "Stillstand erreicht",
  "LU message": "Meldung LU", "terminal 28 low": "Klemme 28 LOW", "no trip any more": "kein TRIP mehr", "undervoltage": "Unterspannung", "trip gone": "TRIP weg",
  // What holds a transition back.
  "undervoltage (LU)": "Unterspannung (LU) ansteht", "terminal 28 is low": "Klemme 28 LOW ist", "the cause of the fault is still there": "die Ursache der Störung noch ansteht",
  // Bits.
  "enable voltage": "Spannung freigeben", "no quick stop": "kein Schnellhalt", "no quick stop in the drive": "kein Schnellhalt im Antrieb",
  "no program start": "kein Programmstart", "no program stop": "kein Programmhalt", "reset the program": "Programm rücksetzen", "manual": "Handfahren",
  "manual negative": "Hand negativ", "manual positive": "Hand positiv", "print-mark mode": "Druckmarkenbetrieb", "voltage enabled": "Spannung freigegeben",
  "switch-on inhibited": "Einschaltsperre", "warning": "Warnung", "message": "Meldung", "controlled over the bus": "über den Bus geführt",
  "set-value reached": "Sollwert erreicht", "limit reached": "Grenzwert erreicht", "FAIL-QSP": "FAIL-QSP", "program runs": "Programm läuft", "ended in target": "im Ziel beendet", "–": "–",
  // Slave and stations.
  "data exchange": "Datenaustausch", "offline": "nicht da", "waitprm": "wartet auf Parameter", "waitcfg": "wartet auf Konfiguration", "waitready": "wartet auf Bereitschaft", "refused": "abgelehnt",
  "slave": "Slave", "master, not ready for the ring": "Master, nicht bereit für den Ring", "master, ready for the ring": "Master, bereit für den Ring", "master in the ring": "Master im Ring",
  // Signals.
  "position set-value": "Lagesollwert", "position actual value": "Lageistwert", "following error": "Schleppfehler", "speed of the interpolator, of C0011": "Drehzahl des Interpolators, bezogen auf C0011",
  "motor speed, filtered, of C0011": "Motordrehzahl, gefiltert, bezogen auf C0011", "motor speed": "Motordrehzahl", "speed set-value, of C0011": "Drehzahlsollwert, bezogen auf C0011",
  "torque set-value, of C0057": "Momentensollwert, bezogen auf C0057", "torque in the air gap": "Luftspaltmoment", "motor current": "Motorstrom", "current along d, peak": "Strom in d, Scheitelwert",
  "current along q, peak": "Strom in q, Scheitelwert", "voltage of the DC link": "Zwischenkreisspannung", "traversing record": "Positioniersatz", "program function outputs, bit by bit": "Programmfunktionsausgänge, Bit für Bit",
  "status word, bit by bit": "Statuswort, Bit für Bit", "present fault, LECOM number": "anstehende Störung, LECOM-Nummer", "level at E1": "Pegel an E1",
  // Causes of faults.
  "system fault of the control unit": "Systemstörung der Steuerung", "communication over the bus module lost": "Kommunikation über das Busmodul gestört",
  "no telegram CAN-IN1 within C0357/1": "kein Telegramm CAN-IN1 innerhalb von C0357/1", "no telegram CAN-IN2 within C0357/2": "kein Telegramm CAN-IN2 innerhalb von C0357/2",
  "no telegram CAN-IN3 within C0357/3": "kein Telegramm CAN-IN3 innerhalb von C0357/3", "system bus off after too many faulty telegrams": "Systembus abgeschaltet nach zu vielen fehlerhaften Telegrammen",
  "external fault, set by a control word": "externe Störung, über ein Steuerwort gesetzt", "internal fault": "interne Störung", "wrong power stage found at power-up": "falsches Leistungsteil beim Einschalten erkannt",
  "temperature sensor of the heat sink": "Temperaturfühler des Kühlkörpers", "temperature sensor inside the device": "Temperaturfühler im Geräteinnern", "a motor phase is missing": "eine Motorphase fehlt",
  "DC-link undervoltage: mains missing or too low": "Unterspannung im Zwischenkreis: Netz fehlt oder ist zu niedrig", "DC-link overvoltage: braking energy is not taken away": "Überspannung im Zwischenkreis: Bremsenergie wird nicht abgeführt",
  "motor faster than C0596": "Motor schneller als C0596", "short circuit": "Kurzschluss", "earth fault": "Erdschluss", "I×t overload, C0064 above 100 %": "I×t-Überlast, C0064 über 100 %",
  "heat sink too warm": "Kühlkörper zu warm", "motor warmer than 150 °C": "Motor wärmer als 150 °C", "heat sink warmer than C0122": "Kühlkörper wärmer als C0122", "motor warmer than C0121": "Motor wärmer als C0121",
  "PTC at T1, T2: motor too warm": "PTC an T1, T2: Motor zu warm", "negative limit switch reached": "negativer Endschalter erreicht", "positive limit switch reached": "positiver Endschalter erreicht",
  "following error above C0255": "Schleppfehler größer als C0255", "target below the negative position limit": "Ziel unter der negativen Positionsgrenze", "target above the positive position limit": "Ziel über der positiven Positionsgrenze",
  "no reference: an absolute target needs homing first": "keine Referenz: ein absolutes Ziel verlangt vorher eine Referenzfahrt", "mode of the record does not fit the configuration": "Art des Satzes passt nicht zur Konfiguration",
  "reference offset out of range": "Referenzoffset außerhalb des Bereichs", "impermissible programming": "unzulässige Programmierung", "range of the encoder exceeded": "Bereich des Gebers überschritten",
  "phase overflow": "Phasenüberlauf", "following error above C1218/1": "Schleppfehler größer als C1218/1", "following error above C1218/2": "Schleppfehler größer als C1218/2",
  "synchronisation over the system bus lost": "Synchronisation über den Systembus verloren", "touch probe could not be worked off": "Touch-Probe konnte nicht abgearbeitet werden", "internal limitation": "interne Begrenzung",
  "program fault of the control unit": "Programmstörung der Steuerung", "initialisation with a wrong parameter set": "Initialisierung mit falschem Parametersatz", "all parameter sets damaged, factory setting loaded": "alle Parametersätze beschädigt, Werkseinstellung geladen",
  "parameter set 1 damaged, factory setting loaded": "Parametersatz 1 beschädigt, Werkseinstellung geladen", "parameter set 2 damaged, factory setting loaded": "Parametersatz 2 beschädigt, Werkseinstellung geladen",
  "parameter set 3 damaged, factory setting loaded": "Parametersatz 3 beschädigt, Werkseinstellung geladen", "parameter set 4 damaged, factory setting loaded": "Parametersatz 4 beschädigt, Werkseinstellung geladen",
  "resolver wire break": "Drahtbruch am Resolver", "encoder at X9/8": "Geber an X9/8", "master current below 2 mA": "Leitstrom unter 2 mA", "temperature sensor of the motor": "Temperaturfühler des Motors", "absolute encoder": "Absolutwertgeber",
  // Remedies.
  "switch the mains off and on; if it comes back the device is defective": "Netz aus- und einschalten; kommt sie wieder, ist das Gerät defekt", "check cable, terminators and master; C1882 says what the drive does": "Kabel, Abschlüsse und Master prüfen; C1882 bestimmt, was der Antrieb tut",
  "check the system bus and its sender, or lengthen C0357/1": "Systembus und Sender prüfen oder C0357/1 verlängern", "check the system bus and its sender, or lengthen C0357/2": "Systembus und Sender prüfen oder C0357/2 verlängern",
  "check the system bus and its sender, or lengthen C0357/3": "Systembus und Sender prüfen oder C0357/3 verlängern", "check wiring, terminators and bit rate of the system bus": "Verdrahtung, Abschlüsse und Bitrate des Systembusses prüfen",
  "find why the master or the terminal set it": "klären, warum Master oder Klemme sie gesetzt hat", "the device is defective": "das Gerät ist defekt", "the device is defective; C0588 = 3 runs on without it": "das Gerät ist defekt; mit C0588 = 3 läuft es ohne ihn weiter",
  "check the motor cable": "Motorkabel prüfen", "check the mains; C0173 sets the threshold": "Netz prüfen; C0173 bestimmt die Schwelle", "brake more slowly or fit a brake module; C0173 sets the threshold": "langsamer bremsen oder Bremsmodul anbauen; C0173 bestimmt die Schwelle",
  "check what drives the motor, its feedback and C0596": "prüfen, was den Motor antreibt, dazu Rückführung und C0596", "check motor and motor cable": "Motor und Motorkabel prüfen",
  "brake and accelerate more gently or less often, or take a larger drive": "sanfter oder seltener bremsen und beschleunigen oder größeren Antrieb nehmen", "let it cool; check fan, filters and load": "abkühlen lassen; Lüfter, Filter und Last prüfen",
  "let it cool; check load and sensor": "abkühlen lassen; Last und Fühler prüfen", "check fan, filters and load": "Lüfter, Filter und Last prüfen", "check load and cooling of the motor": "Last und Kühlung des Motors prüfen",
  "move away in positive direction by hand": "von Hand in positiver Richtung freifahren", "move away in negative direction by hand": "von Hand in negativer Richtung freifahren",
  "check for a blocked axis, too little torque (C0022) or too fast a set-value": "auf blockierte Achse, zu wenig Moment (C0022) oder zu schnellen Sollwert prüfen", "correct target or limit": "Ziel oder Grenze berichtigen",
  "start homing or set a reference": "Referenzfahrt starten oder Referenz setzen", "correct the record or C1210": "Satz oder C1210 berichtigen", "correct the offset": "Offset berichtigen", "correct the traversing program": "Positionierprogramm berichtigen",
  "set a new reference": "neue Referenz setzen", "reduce the speed or the following error": "Drehzahl oder Schleppfehler verringern", "check sender and cycle of the sync telegram": "Sender und Zyklus des Sync-Telegramms prüfen",
  "check sensor and record": "Sensor und Satz prüfen", "reduce speed or acceleration": "Drehzahl oder Beschleunigung verringern", "load the factory setting and set the parameters anew": "Werkseinstellung laden und neu parametrieren",
  "set the parameters, save them, switch the mains off and on": "parametrieren, speichern, Netz aus- und einschalten", "set the parameters and save them with C0003 = 1": "parametrieren und mit C0003 = 1 speichern",
  "set the parameters and save them with C0003 = 2": "parametrieren und mit C0003 = 2 speichern", "set the parameters and save them with C0003 = 3": "parametrieren und mit C0003 = 3 speichern", "set the parameters and save them with C0003 = 4": "parametrieren und mit C0003 = 4 speichern",
  "check cable and plug X7": "Kabel und Stecker X7 prüfen", "check the cable of the digital frequency input": "Kabel des Leitfrequenzeingangs prüfen", "check the cable of the analog input": "Kabel des Analogeingangs prüfen",
  "check cable and plug X7 or X8": "Kabel und Stecker X7 oder X8 prüfen", "check its cable": "sein Kabel prüfen",
};
