-- PROFIBUS for Wireshark: FDL telegrams (SD1, SD2, SD3, SD4, SC), DP-V0 services and DP-V1 PDUs.
--
-- Wireshark knows no dissector for link type 257 (LINKTYPE_PROFIBUS_DL) and opens such files with unknown encapsulation; this script
-- registers there. It needs Wireshark or tshark 3.0 or later with Lua, and nothing else.
--
--   once          tshark -2 -X lua_script:profibus.lua -r capture.pcapng     (-2: two passes, so that requests know their answers)
--   for good      copy it into the folder "Personal Lua Plugins" named in Help > About Wireshark > Folders
--                 (Linux ~/.local/lib/wireshark/plugins, Windows %APPDATA%\Wireshark\plugins)
--
-- Filters to begin with:
--   profibus.da == 3 || profibus.sa == 3      everything of station 3
--   profibus.service == "Slave_Diag"          a service
--   profibus_dp.diag.ext_diag == 1            slaves that report a fault
--   profibus.retry_of                         repeated requests
--   profibus.fcs.status == 0                  wrong check sums
--   profibus.request && !profibus.response_in requests without an answer
--   profibus.response_time > 0.001            slow answers
--
-- Source: IEC 61158-4-3 (FDL), IEC 61158-6-3 (DP). Octet layouts are also described in the documentation of the Rust modules wire and dp.

local fdl = Proto("profibus", "PROFIBUS FDL")
local dp = Proto("profibus_dp", "PROFIBUS DP")

fdl.prefs.baud = Pref.uint("Baud rate in bit/s", 0,
    "Of the captured line. With it answers are timed from the end of the request, in bit times; 0: only from start to start.")

-- ---------------------------------------------------------------------------------------------------------------------------------------
-- Names

local SD_NAMES = {
    [0x10] = "SD1, no data", [0x68] = "SD2, variable length", [0xA2] = "SD3, eight data octets",
    [0xDC] = "SD4, token", [0xE5] = "SC, short acknowledgement",
}
local REQUEST_NAMES = {
    [0x00] = "Time_Event", [0x03] = "SDA low", [0x04] = "SDN low", [0x05] = "SDA high", [0x06] = "SDN high", [0x07] = "MSRD",
    [0x09] = "FDL_Status", [0x0C] = "SRD low", [0x0D] = "SRD high", [0x0E] = "Ident", [0x0F] = "LSAP_Status", [0x80] = "Clock_Value",
}
local RESPONSE_NAMES = {
    [0x00] = "OK", [0x01] = "UE, user error", [0x02] = "RR, no resource", [0x03] = "RS, no service activated",
    [0x08] = "DL, data low", [0x09] = "NR, no reply data", [0x0A] = "DH, data high",
    [0x0C] = "RDL, data low, no resource", [0x0D] = "RDH, data high, no resource",
}
local RESPONSE_SHORT = {
    [0x00] = "OK", [0x01] = "UE", [0x02] = "RR", [0x03] = "RS", [0x08] = "DL", [0x09] = "NR", [0x0A] = "DH", [0x0C] = "RDL",
    [0x0D] = "RDH",
}
local STATION_NAMES = { [0] = "slave", [1] = "master not ready", [2] = "master ready for the ring", [3] = "master in the ring" }
-- Requests that nobody answers.
local UNACKNOWLEDGED = { [0x00] = true, [0x04] = true, [0x06] = true, [0x80] = true }

-- Access points. 62 is Chk_Cfg at a slave and stands for a master everywhere else, so the side decides.
local SLAVE_SAPS = {
    [49] = "MSAC2 RM", [50] = "MSAC1 alarm", [51] = "MSAC1", [53] = "Ext_Set_Prm", [54] = "Master_Master", [55] = "Set_Slave_Add",
    [56] = "Rd_Inp", [57] = "Rd_Outp", [58] = "Global_Control", [59] = "Get_Cfg", [60] = "Slave_Diag", [61] = "Set_Prm",
    [62] = "Chk_Cfg", [63] = "all",
}
local MASTER_SAPS = { [50] = "MSAC2", [51] = "MSAC1", [54] = "Master_Master", [62] = "MS0", [63] = "all" }

local FUNCTION_NUM = {
    [0x41] = "Get_Master_Diag", [0x42] = "Start_Seq", [0x43] = "Download", [0x44] = "Upload", [0x45] = "End_Seq",
    [0x46] = "Act_Para_Brct", [0x47] = "Act_Param", [0x48] = "Idle", [0x51] = "Data_Transport", [0x56] = "RM", [0x57] = "Initiate",
    [0x58] = "Abort", [0x5C] = "Alarm_Ack", [0x5E] = "Read", [0x5F] = "Write",
}
local ERROR_CLASS = { [10] = "application", [11] = "access", [12] = "resource", [13] = "user", [14] = "user", [15] = "user" }
local ERROR_CODE_1 = {
    [0xA0] = "read error", [0xA1] = "write error", [0xA2] = "module failure", [0xA8] = "version conflict",
    [0xA9] = "feature not supported", [0xB0] = "invalid index", [0xB1] = "write length error", [0xB2] = "invalid slot",
    [0xB3] = "type conflict", [0xB4] = "invalid area", [0xB5] = "state conflict", [0xB6] = "access denied", [0xB7] = "invalid range",
    [0xB8] = "invalid parameter", [0xB9] = "invalid type", [0xC0] = "read constrain conflict", [0xC1] = "write constrain conflict",
    [0xC2] = "resource busy", [0xC3] = "resource unavailable",
}
local ABORT_INSTANCE = { [0] = "FDL", [1] = "MSAC2", [2] = "USER" }
local ABORT_REASON = {
    [1] = "ABT_SE, sequence error", [2] = "ABT_FE, invalid request", [3] = "ABT_TO, timeout", [4] = "ABT_RE, invalid response",
    [5] = "ABT_IV, invalid service", [6] = "ABT_STO, Send_Timeout too small", [7] = "ABT_IA, additional address invalid",
    [8] = "ABT_OC, waiting for FDL", [15] = "ABT_RES, no resource",
}
local BLOCK_KINDS = { [0] = "device", [1] = "identifiers", [2] = "channel", [3] = "revision" }
local ALARM_TYPES = { [1] = "diagnosis", [2] = "process", [3] = "pull", [4] = "plug", [5] = "status", [6] = "update" }
local STATUS_TYPES = { [1] = "Status_Message", [2] = "Modul_Status", [3] = "DxB_Link_Status", [30] = "PrmCmdAck", [31] = "Red_State" }
local ALARM_SPECIFIER = {
    [0] = "no further differentiation", [1] = "appears", [2] = "disappears", [3] = "disappears, others remain",
}
local CHANNEL_DIRECTION = { [1] = "input", [2] = "output", [3] = "input and output" }
local CHANNEL_TYPE = { [1] = "bit", [2] = "2 bit", [3] = "4 bit", [4] = "octet", [5] = "word", [6] = "2 words" }
local CHANNEL_FAULT = {
    [1] = "short circuit", [2] = "undervoltage", [3] = "overvoltage", [4] = "overload", [5] = "overtemperature", [6] = "wire break",
    [7] = "upper limit exceeded", [8] = "lower limit exceeded", [9] = "error",
}
local LOCK_NAMES = { [0] = "keep, min Tsdr only", [1] = "unlock", [2] = "lock", [3] = "unlock" }

-- ---------------------------------------------------------------------------------------------------------------------------------------
-- Fields

local YES_NO = { "yes", "no" }
local f = {
    sd = ProtoField.uint8("profibus.sd", "Start delimiter", base.HEX, SD_NAMES),
    le = ProtoField.uint8("profibus.le", "Length LE", base.DEC),
    ler = ProtoField.uint8("profibus.ler", "Length repeated LEr", base.DEC),
    sd_again = ProtoField.uint8("profibus.sd_again", "Start delimiter repeated", base.HEX),
    da = ProtoField.uint8("profibus.da", "Destination address DA", base.DEC, nil, 0x7F),
    da_ext = ProtoField.bool("profibus.da.ext", "Access point follows", 8, YES_NO, 0x80),
    sa = ProtoField.uint8("profibus.sa", "Source address SA", base.DEC, nil, 0x7F),
    sa_ext = ProtoField.bool("profibus.sa.ext", "Access point follows", 8, YES_NO, 0x80),
    fc = ProtoField.uint8("profibus.fc", "Function code FC", base.HEX),
    fc_request = ProtoField.bool("profibus.fc.request", "Frame type", 8, { "request", "response" }, 0x40),
    fc_fcb = ProtoField.bool("profibus.fc.fcb", "Frame count bit FCB", 8, { "1", "0" }, 0x20),
    fc_fcv = ProtoField.bool("profibus.fc.fcv", "FCB valid FCV", 8, { "1", "0" }, 0x10),
    fc_function = ProtoField.uint8("profibus.fc.function", "Request", base.HEX, REQUEST_NAMES, 0x8F),
    fc_station = ProtoField.uint8("profibus.fc.station", "Station type", base.DEC, STATION_NAMES, 0x30),
    fc_response = ProtoField.uint8("profibus.fc.response", "Response", base.HEX, RESPONSE_NAMES, 0x8F),
    dsap = ProtoField.uint8("profibus.dsap", "Destination access point DSAP", base.DEC),
    ssap = ProtoField.uint8("profibus.ssap", "Source access point SSAP", base.DEC),
    data = ProtoField.bytes("profibus.data", "Data"),
    fcs = ProtoField.uint8("profibus.fcs", "Frame check sequence FCS", base.HEX),
    fcs_status = ProtoField.uint8("profibus.fcs.status", "FCS status", base.DEC, { [0] = "bad", [1] = "good" }),
    ed = ProtoField.uint8("profibus.ed", "End delimiter", base.HEX),
    service = ProtoField.string("profibus.service", "Service"),
    request = ProtoField.bool("profibus.request", "Request"),
    response = ProtoField.bool("profibus.response", "Response"),
    request_in = ProtoField.framenum("profibus.request_in", "Answers", base.NONE, frametype.REQUEST),
    response_in = ProtoField.framenum("profibus.response_in", "Answered in", base.NONE, frametype.RESPONSE),
    response_time = ProtoField.double("profibus.response_time", "Time since the start of the request (s)"),
    t_sdr = ProtoField.double("profibus.t_sdr", "Tsdr (bit times)"),
    retry_of = ProtoField.framenum("profibus.retry_of", "Repetition of", base.NONE, frametype.RETRANS_PREV),
    rotation = ProtoField.double("profibus.token.rotation", "Token rotation time (s)"),
    lost = ProtoField.uint32("profibus.lost", "Characters that could not be received", base.DEC),
    invalid = ProtoField.bytes("profibus.invalid", "Octets of no valid telegram"),
}
fdl.fields = f

local bit = function(name, label, mask)
    return ProtoField.bool("profibus_dp." .. name, label, 8, YES_NO, mask)
end
local d = {
    inputs = ProtoField.bytes("profibus_dp.inputs", "Inputs"),
    outputs = ProtoField.bytes("profibus_dp.outputs", "Outputs"),
    -- Slave_Diag
    station_non_existent = bit("diag.station_non_existent", "Station_Non_Existent", 0x01),
    station_not_ready = bit("diag.station_not_ready", "Station_Not_Ready", 0x02),
    cfg_fault = bit("diag.cfg_fault", "Cfg_Fault", 0x04),
    ext_diag = bit("diag.ext_diag", "Ext_Diag", 0x08),
    not_supported = bit("diag.not_supported", "Not_Supported", 0x10),
    invalid_response = bit("diag.invalid_slave_response", "Invalid_Slave_Response", 0x20),
    prm_fault = bit("diag.prm_fault", "Prm_Fault", 0x40),
    master_lock = bit("diag.master_lock", "Master_Lock", 0x80),
    prm_req = bit("diag.prm_req", "Prm_Req", 0x01),
    stat_diag = bit("diag.stat_diag", "Stat_Diag", 0x02),
    wd_on = bit("diag.wd_on", "WD_On", 0x08),
    freeze_mode = bit("diag.freeze_mode", "Freeze_Mode", 0x10),
    sync_mode = bit("diag.sync_mode", "Sync_Mode", 0x20),
    deactivated = bit("diag.deactivated", "Deactivated", 0x80),
    overflow = bit("diag.ext_diag_overflow", "Ext_Diag_Overflow", 0x80),
    diag_status = ProtoField.uint24("profibus_dp.diag.status", "Station status", base.HEX),
    diag_master = ProtoField.uint8("profibus_dp.diag.master", "Master address (255: none)", base.DEC),
    ident = ProtoField.uint16("profibus_dp.ident", "Ident number", base.HEX),
    block = ProtoField.bytes("profibus_dp.diag.block", "Block"),
    block_kind = ProtoField.uint8("profibus_dp.diag.block.kind", "Kind", base.DEC, BLOCK_KINDS, 0xC0),
    block_length = ProtoField.uint8("profibus_dp.diag.block.length", "Length with header", base.DEC, nil, 0x3F),
    block_data = ProtoField.bytes("profibus_dp.diag.block.data", "Data"),
    module = ProtoField.uint8("profibus_dp.diag.module", "Module with diagnosis", base.DEC),
    channel_module = ProtoField.uint8("profibus_dp.diag.channel.module", "Module", base.DEC, nil, 0x3F),
    channel_direction = ProtoField.uint8("profibus_dp.diag.channel.direction", "Direction", base.DEC, CHANNEL_DIRECTION, 0xC0),
    channel_number = ProtoField.uint8("profibus_dp.diag.channel.number", "Channel", base.DEC, nil, 0x3F),
    channel_type = ProtoField.uint8("profibus_dp.diag.channel.type", "Type", base.DEC, CHANNEL_TYPE, 0xE0),
    channel_fault = ProtoField.uint8("profibus_dp.diag.channel.fault", "Fault", base.DEC, CHANNEL_FAULT, 0x1F),
    revision = ProtoField.uint8("profibus_dp.diag.revision", "Revision", base.DEC, nil, 0x3F),
    alarm_type = ProtoField.uint8("profibus_dp.alarm.type", "Alarm type", base.DEC, ALARM_TYPES, 0x7F),
    status_type = ProtoField.uint8("profibus_dp.status.type", "Status type", base.DEC, STATUS_TYPES, 0x7F),
    alarm_sequence = ProtoField.uint8("profibus_dp.alarm.sequence", "Sequence number", base.DEC, nil, 0xF8),
    alarm_add_ack = bit("alarm.add_ack", "Add_Ack", 0x04),
    alarm_specifier = ProtoField.uint8("profibus_dp.alarm.specifier", "Specifier", base.DEC, ALARM_SPECIFIER, 0x03),
    -- Set_Prm
    prm_lock = ProtoField.uint8("profibus_dp.prm.lock", "Lock", base.DEC, LOCK_NAMES, 0xC0),
    prm_sync = bit("prm.sync_req", "Sync_Req", 0x20),
    prm_freeze = bit("prm.freeze_req", "Freeze_Req", 0x10),
    prm_wd = bit("prm.wd_on", "WD_On", 0x08),
    prm_fact_1 = ProtoField.uint8("profibus_dp.prm.wd_fact_1", "WD_Fact_1", base.DEC),
    prm_fact_2 = ProtoField.uint8("profibus_dp.prm.wd_fact_2", "WD_Fact_2", base.DEC),
    prm_watchdog = ProtoField.uint32("profibus_dp.prm.watchdog", "Watchdog (ms)", base.DEC),
    prm_tsdr = ProtoField.uint8("profibus_dp.prm.min_tsdr", "min Tsdr in bit times (0: keep)", base.DEC),
    prm_group = ProtoField.uint8("profibus_dp.prm.group", "Group ident", base.HEX),
    prm_user = ProtoField.bytes("profibus_dp.prm.user", "User parameters"),
    -- Chk_Cfg, Get_Cfg
    identifier = ProtoField.bytes("profibus_dp.cfg.identifier", "Identifier"),
    cfg_inputs = ProtoField.uint32("profibus_dp.cfg.inputs", "Input octets", base.DEC),
    cfg_outputs = ProtoField.uint32("profibus_dp.cfg.outputs", "Output octets", base.DEC),
    -- Global_Control
    gc_clear = bit("gc.clear_data", "Clear_Data", 0x02),
    gc_unfreeze = bit("gc.unfreeze", "Unfreeze", 0x04),
    gc_freeze = bit("gc.freeze", "Freeze", 0x08),
    gc_unsync = bit("gc.unsync", "Unsync", 0x10),
    gc_sync = bit("gc.sync", "Sync", 0x20),
    gc_group = ProtoField.uint8("profibus_dp.gc.group", "Group select (0: all)", base.HEX),
    -- Set_Slave_Add
    new_address = ProtoField.uint8("profibus_dp.ssa.new_address", "New address", base.DEC),
    no_add_chg = ProtoField.bool("profibus_dp.ssa.no_add_chg", "No_Add_Chg, no later change"),
    remote_data = ProtoField.bytes("profibus_dp.ssa.data", "Rem_Slave_Data"),
    -- DP-V1
    negative = bit("v1.negative", "Negative response", 0x80),
    fn = ProtoField.uint8("profibus_dp.v1.function", "Function", base.HEX, FUNCTION_NUM, 0x7F),
    slot = ProtoField.uint8("profibus_dp.v1.slot", "Slot", base.DEC),
    index = ProtoField.uint8("profibus_dp.v1.index", "Index", base.DEC),
    length = ProtoField.uint8("profibus_dp.v1.length", "Length", base.DEC),
    record = ProtoField.bytes("profibus_dp.v1.data", "Record"),
    error_decode = ProtoField.uint8("profibus_dp.v1.error_decode", "Error_Decode", base.DEC,
        { [128] = "DPV1", [254] = "FMS", [255] = "HART" }),
    error_class = ProtoField.uint8("profibus_dp.v1.error_class", "Error class", base.DEC, ERROR_CLASS, 0xF0),
    error_code_1 = ProtoField.uint8("profibus_dp.v1.error_code_1", "Error_Code_1", base.HEX, ERROR_CODE_1),
    error_code_2 = ProtoField.uint8("profibus_dp.v1.error_code_2", "Error_Code_2", base.HEX),
    server_sap = ProtoField.uint8("profibus_dp.v1.server_sap", "Server_SAP", base.DEC),
    send_timeout = ProtoField.uint16("profibus_dp.v1.send_timeout", "Send_Timeout (10 ms)", base.DEC),
    max_len = ProtoField.uint8("profibus_dp.v1.max_len_data_unit", "Max_Len_Data_Unit", base.DEC),
    features = ProtoField.bytes("profibus_dp.v1.features", "Features_Supported"),
    profile_features = ProtoField.bytes("profibus_dp.v1.profile_features", "Profile_Features_Supported"),
    profile_ident = ProtoField.uint16("profibus_dp.v1.profile_ident", "Profile_Ident_Number", base.HEX),
    add_addr = ProtoField.bytes("profibus_dp.v1.add_addr_param", "Add_Addr_Param"),
    abort_subnet = ProtoField.uint8("profibus_dp.v1.abort.subnet", "Subnet", base.DEC,
        { [0] = "no information", [1] = "local", [2] = "remote" }),
    abort_instance = ProtoField.uint8("profibus_dp.v1.abort.instance", "Instance", base.DEC, ABORT_INSTANCE, 0x30),
    abort_reason = ProtoField.uint8("profibus_dp.v1.abort.reason", "Reason", base.DEC, ABORT_REASON, 0x0F),
    other = ProtoField.bytes("profibus_dp.data", "Data"),
}
dp.fields = d

local e = {
    fcs = ProtoExpert.new("profibus.fcs.bad", "Wrong frame check sequence", expert.group.CHECKSUM, expert.severity.ERROR),
    format = ProtoExpert.new("profibus.format.bad", "No valid telegram", expert.group.MALFORMED, expert.severity.ERROR),
    retry = ProtoExpert.new("profibus.retry", "Request repeated", expert.group.SEQUENCE, expert.severity.WARN),
    refused = ProtoExpert.new("profibus.refused", "Request refused", expert.group.RESPONSE_CODE, expert.severity.WARN),
    stray = ProtoExpert.new("profibus.stray", "Answer that nobody asked for", expert.group.SEQUENCE, expert.severity.NOTE),
}
fdl.experts = { e.fcs, e.format, e.retry, e.refused, e.stray }
local x = {
    short = ProtoExpert.new("profibus_dp.short", "Data unit too short", expert.group.MALFORMED, expert.severity.ERROR),
    diag = ProtoExpert.new("profibus_dp.diag.fault", "The slave reports a fault", expert.group.RESPONSE_CODE, expert.severity.WARN),
    block = ProtoExpert.new("profibus_dp.diag.block.bad", "Block with an impossible length", expert.group.MALFORMED, expert.severity.WARN),
    negative = ProtoExpert.new("profibus_dp.v1.refused", "Negative response", expert.group.RESPONSE_CODE, expert.severity.WARN),
}
dp.experts = { x.short, x.diag, x.block, x.negative }

-- The reason that the recording program wrote down, and its error flags.
local frame_comment = Field.new("frame.comment")

-- ---------------------------------------------------------------------------------------------------------------------------------------
-- What one telegram says about others. It is learned when the packets are seen for the first time, in their order.

local pending      -- the request that waits for its answer
local last_token   -- source address → time of its last token
local relations    -- packet number → { request =, response =, time =, t_sdr =, retry_of =, rotation =, service = }

local function forget()
    pending, last_token, relations = nil, {}, {}
end
forget()
fdl.init = forget -- a file is opened

local function relation(number)
    local there = relations[number]
    if not there then
        there = {}
        relations[number] = there
    end
    return there
end

local function learn_request(pinfo, raw, da, sa, service, acknowledged)
    if not acknowledged then
        pending = nil
        return
    end
    local here = relation(pinfo.number)
    if pending and pending.raw == raw then
        here.retry_of = pending.number
    end
    pending = { number = pinfo.number, raw = raw, da = da, sa = sa, time = pinfo.rel_ts, service = service, length = #raw / 2 }
end

local function learn_response(pinfo, da, sa)
    -- A short acknowledgement has no addresses and answers whatever was asked last.
    if not pending or (da and (pending.sa ~= da or pending.da ~= sa)) then
        return
    end
    local here, there = relation(pinfo.number), relation(pending.number)
    here.request, there.response = pending.number, pinfo.number
    here.time = pinfo.rel_ts - pending.time
    here.service, here.peers = pending.service, { da = pending.sa, sa = pending.da }
    if fdl.prefs.baud > 0 then
        here.t_sdr = here.time * fdl.prefs.baud - 11 * pending.length
    end
    pending = nil
end

local function learn_token(pinfo, sa)
    pending = nil
    if last_token[sa] then
        relation(pinfo.number).rotation = pinfo.rel_ts - last_token[sa]
    end
    last_token[sa] = pinfo.rel_ts
end

-- ---------------------------------------------------------------------------------------------------------------------------------------
-- Services

local NO_RESPONSE_DATA = { [0x00] = true, [0x01] = true, [0x02] = true, [0x03] = true, [0x09] = true }

-- By the access point on the slave's side; nil when the telegram alone does not tell.
local function service_of(is_request, fn, slave_sap, master_sap, length)
    if is_request then
        local own = { [0x09] = "FDL_Status", [0x0E] = "Ident", [0x0F] = "LSAP_Status", [0x00] = "Clock", [0x80] = "Clock" }
        if own[fn] then
            return own[fn]
        end
    elseif not slave_sap and not master_sap and length == 0 and NO_RESPONSE_DATA[fn] then
        return nil
    end
    if not slave_sap and not master_sap then
        if is_request and fn ~= 0x0C and fn ~= 0x0D and fn ~= 0x07 then
            return "FDL"
        end
        return "Data_Exchange"
    elseif not slave_sap then
        return "FDL"
    elseif slave_sap >= 55 and slave_sap <= 62 then
        return SLAVE_SAPS[slave_sap]
    elseif slave_sap == 53 and master_sap == 62 then
        return "Ext_Set_Prm"
    elseif slave_sap == 54 and master_sap == 54 then
        return "Master_Master"
    elseif (slave_sap == 50 or slave_sap == 51) and master_sap == 51 then
        return "MSAC1"
    elseif slave_sap <= 49 and master_sap == 50 then
        return "MSAC2"
    end
    return "FDL"
end

local function sap_name(sap, is_slave)
    local name = (is_slave and SLAVE_SAPS or MASTER_SAPS)[sap]
    if not name and is_slave and sap <= 48 then
        name = "MSAC2"
    end
    return name and (" (" .. name .. ")") or ""
end

local function hex(range)
    return (tostring(range:bytes()):gsub("(%x%x)", "%1 "):gsub(" $", ""))
end

local function short(tree, range, least)
    if range and range:len() >= least then
        return false
    end
    tree:add_proto_expert_info(x.short, "at least " .. least .. " octets expected, got " .. (range and range:len() or 0))
    return true
end

-- The part of a range from an offset on; nil when nothing is left.
local function from(range, offset)
    if range and range:len() > offset then
        return range(offset)
    end
end

-- Alarm or status message of DP-V1 inside a device-related block.
local function alarm(tree, data)
    if data:len() < 3 then
        return
    end
    local is_status = data(0, 1):bitfield(0, 1) == 1
    local branch = tree:add(dp, data, is_status and "Status message, if the slave is a DP-V1 slave" or "Alarm, if the slave is a DP-V1 slave")
    branch:add(is_status and d.status_type or d.alarm_type, data(0, 1))
    branch:add(d.slot, data(1, 1))
    branch:add(d.alarm_sequence, data(2, 1))
    branch:add(d.alarm_add_ack, data(2, 1))
    branch:add(d.alarm_specifier, data(2, 1))
    if data:len() > 3 then
        branch:add(d.block_data, data(3))
    end
end

local function diag_blocks(tree, rest)
    while rest do
        local kind, length = rest(0, 1):bitfield(0, 2), rest(0, 1):bitfield(2, 6)
        if kind == 2 then
            length = 3
        elseif kind == 3 then
            length = 1
        end
        if length == 0 or length > rest:len() then
            tree:add(d.block, rest):add_proto_expert_info(x.block, "length " .. length .. " of " .. rest:len() .. " octets left")
            return
        end
        local block = rest(0, length)
        local branch = tree:add(d.block, block)
        branch:add(d.block_kind, block(0, 1))
        branch:append_text(" (" .. BLOCK_KINDS[kind] .. ")")
        if kind <= 1 then
            branch:add(d.block_length, block(0, 1))
        end
        if kind == 0 and length > 1 then
            branch:add(d.block_data, block(1))
            alarm(branch, block(1))
        elseif kind == 1 then
            for octet = 1, length - 1 do
                for place = 0, 7 do
                    if block(octet, 1):bitfield(7 - place, 1) == 1 then
                        branch:add(d.module, block(octet, 1), (octet - 1) * 8 + place)
                    end
                end
            end
        elseif kind == 2 then
            branch:add(d.channel_module, block(0, 1))
            branch:add(d.channel_direction, block(1, 1))
            branch:add(d.channel_number, block(1, 1))
            branch:add(d.channel_type, block(2, 1))
            branch:add(d.channel_fault, block(2, 1))
        elseif kind == 3 then
            branch:add(d.revision, block(0, 1))
        end
        rest = from(rest, length)
    end
end

local STATUS_BITS = {
    { 0, 7, "station_non_existent" }, { 0, 6, "station_not_ready" }, { 0, 5, "cfg_fault" }, { 0, 4, "ext_diag" },
    { 0, 3, "not_supported" }, { 0, 2, "invalid_response" }, { 0, 1, "prm_fault" }, { 0, 0, "master_lock" }, { 1, 7, "prm_req" },
    { 1, 6, "stat_diag" }, { 1, 4, "wd_on" }, { 1, 3, "freeze_mode" }, { 1, 2, "sync_mode" }, { 1, 0, "deactivated" },
    { 2, 0, "overflow" },
}
local STATUS_NAMES = {
    station_non_existent = "Station_Non_Existent", station_not_ready = "Station_Not_Ready", cfg_fault = "Cfg_Fault",
    ext_diag = "Ext_Diag", not_supported = "Not_Supported", invalid_response = "Invalid_Slave_Response", prm_fault = "Prm_Fault",
    master_lock = "Master_Lock", prm_req = "Prm_Req", stat_diag = "Stat_Diag", wd_on = "WD_On", freeze_mode = "Freeze_Mode",
    sync_mode = "Sync_Mode", deactivated = "Deactivated", overflow = "Ext_Diag_Overflow",
}
local FAULTS = { cfg_fault = true, ext_diag = true, not_supported = true, prm_fault = true }

local function slave_diag(tree, data)
    if short(tree, data, 6) then
        return ""
    end
    local branch = tree:add(d.diag_status, data(0, 3))
    local names, faults = {}, {}
    for _, entry in ipairs(STATUS_BITS) do
        local octet, place, key = entry[1], entry[2], entry[3]
        branch:add(d[key], data(octet, 1))
        if data(octet, 1):bitfield(place, 1) == 1 then
            names[#names + 1] = STATUS_NAMES[key]
            if FAULTS[key] then
                faults[#faults + 1] = STATUS_NAMES[key]
            end
        end
    end
    if #faults > 0 then
        branch:add_proto_expert_info(x.diag, table.concat(faults, ", "))
    end
    tree:add(d.diag_master, data(3, 1))
    tree:add(d.ident, data(4, 2))
    diag_blocks(tree, from(data, 6))
    local master = data(3, 1):uint()
    local text = string.format("[%s] master %s ident %04X", table.concat(names, " "), master == 255 and "none" or master, data(4, 2):uint())
    return data:len() > 6 and text .. " " .. hex(data(6)) or text
end

local function set_prm(tree, data)
    if short(tree, data, 7) then
        return ""
    end
    local status = data(0, 1)
    for _, field in ipairs { d.prm_lock, d.prm_sync, d.prm_freeze, d.prm_wd } do
        tree:add(field, status)
    end
    tree:add(d.prm_fact_1, data(1, 1))
    tree:add(d.prm_fact_2, data(2, 1))
    local user = from(data, 7)
    -- WD_Base_1ms of DP-V1, in the first octet of the user parameters of a DP-V1 slave.
    local is_v1 = user and user(0, 1):bitfield(0, 1) == 1
    local watchdog = data(1, 1):uint() * data(2, 1):uint() * ((is_v1 and user(0, 1):bitfield(5, 1) == 1) and 1 or 10)
    local wd_on = status:bitfield(4, 1) == 1
    if wd_on then
        tree:add(d.prm_watchdog, data(1, 2), watchdog):set_generated()
    end
    tree:add(d.prm_tsdr, data(3, 1))
    tree:add(d.ident, data(4, 2))
    tree:add(d.prm_group, data(6, 1))
    if user then
        tree:add(d.prm_user, user)
    end
    local words = { [0] = "keep", "unlock", "lock", "unlock" }
    local text = words[status:bitfield(0, 2)]
    if wd_on then
        text = text .. " WD " .. watchdog .. " ms"
    end
    text = text .. string.format(" min Tsdr %d ident %04X group %02X", data(3, 1):uint(), data(4, 2):uint(), data(6, 1):uint())
    return user and text .. " user " .. hex(user) or text
end

-- Number of units in words, and octets they take; `range` is the octet with the length, `first` the first of its bits.
local function amount(range, first)
    local words = range:bitfield(1, 1) == 1
    local count = range:bitfield(first, 8 - first) + 1
    local text = count .. (words and " word" or " octet") .. (count == 1 and "" or "s")
    return text, count * (words and 2 or 1)
end

-- Identifiers in the general and the special format.
local function configuration(tree, data)
    if short(tree, data, 1) then
        return ""
    end
    local inputs, outputs, texts, rest = 0, 0, {}, data
    while rest do
        local id = rest(0, 1)
        local length, text, whole = 1, "", id:bitfield(0, 1) == 1
        if id:bitfield(2, 2) ~= 0 then
            local part, octets = amount(id, 4)
            local is_in, is_out = id:bitfield(3, 1) == 1, id:bitfield(2, 1) == 1
            inputs = inputs + (is_in and octets or 0)
            outputs = outputs + (is_out and octets or 0)
            text = part .. (is_in and is_out and " in+out" or is_in and " in" or " out") .. (whole and " whole" or "")
        else
            local parts = {}
            -- Where both lengths follow, the outputs come first.
            for place, direction in ipairs { "out", "in" } do
                if id:bitfield(place - 1, 1) == 1 and rest:len() > length then
                    local part, octets = amount(rest(length, 1), 2)
                    parts[#parts + 1] = part .. " " .. direction .. (rest(length, 1):bitfield(0, 1) == 1 and " whole" or "")
                    inputs = inputs + (direction == "in" and octets or 0)
                    outputs = outputs + (direction == "out" and octets or 0)
                    length = length + 1
                end
            end
            local own = id:bitfield(4, 4)
            own = own == 15 and 0 or own
            text = #parts > 0 and table.concat(parts, " + ") or "empty slot"
            if own > 0 then
                text = text .. " manufacturer " .. own .. " octets"
            end
            length = math.min(length + own, rest:len())
        end
        tree:add(d.identifier, rest(0, length)):append_text(" = " .. text)
        texts[#texts + 1] = hex(rest(0, length)) .. " = " .. text
        rest = from(rest, length)
    end
    tree:add(d.cfg_inputs, data, inputs):set_generated()
    tree:add(d.cfg_outputs, data, outputs):set_generated()
    return table.concat(texts, ", ")
end

local function global_control(tree, data)
    if short(tree, data, 2) then
        return ""
    end
    local names = {}
    for _, entry in ipairs {
        { 6, d.gc_clear, "Clear_Data" }, { 5, d.gc_unfreeze, "Unfreeze" }, { 4, d.gc_freeze, "Freeze" }, { 3, d.gc_unsync, "Unsync" },
        { 2, d.gc_sync, "Sync" },
    } do
        tree:add(entry[2], data(0, 1))
        if data(0, 1):bitfield(entry[1], 1) == 1 then
            names[#names + 1] = entry[3]
        end
    end
    tree:add(d.gc_group, data(1, 1))
    local group = data(1, 1):uint()
    return (#names == 0 and "Operate" or table.concat(names, " ")) .. (group == 0 and ", all groups" or string.format(", groups %02X", group))
end

local function set_slave_add(tree, data)
    if short(tree, data, 4) then
        return ""
    end
    tree:add(d.new_address, data(0, 1))
    tree:add(d.ident, data(1, 2))
    tree:add(d.no_add_chg, data(3, 1), data(3, 1):uint() ~= 0)
    if data:len() > 4 then
        tree:add(d.remote_data, data(4))
    end
    return string.format("new address %d ident %04X%s", data(0, 1):uint(), data(1, 2):uint(), data(3, 1):uint() ~= 0 and " locked" or "")
end

local function initiate(tree, data, is_request)
    -- Request: reserved (3), Send_Timeout (2); response: Max_Len_Data_Unit (1). Then both the same.
    local offset
    if is_request then
        if short(tree, data, 12) then
            return ""
        end
        tree:add(d.send_timeout, data(4, 2))
        offset = 6
    else
        if short(tree, data, 8) then
            return ""
        end
        tree:add(d.max_len, data(1, 1))
        offset = 2
    end
    tree:add(d.features, data(offset, 2))
    tree:add(d.profile_features, data(offset + 2, 2))
    tree:add(d.profile_ident, data(offset + 4, 2))
    local address = from(data, offset + 6)
    if address then
        tree:add(d.add_addr, address)
    end
    if is_request then
        return " Send_Timeout " .. data(4, 2):uint() * 10 .. " ms"
    end
    return " Max_Len_Data_Unit " .. data(1, 1):uint()
end

local function acyclic(tree, data, is_request)
    if not data then
        return is_request and "poll" or "nothing yet"
    end
    tree:add(d.negative, data(0, 1))
    tree:add(d.fn, data(0, 1))
    local negative, fn = data(0, 1):bitfield(0, 1) == 1, data(0, 1):bitfield(1, 7)
    local text = FUNCTION_NUM[fn] or string.format("function %02X", fn)
    if negative then
        if short(tree, data, 4) then
            return text .. " refused"
        end
        tree:add(d.error_decode, data(1, 1))
        local branch = tree:add(d.error_code_1, data(2, 1))
        branch:add(d.error_class, data(2, 1))
        tree:add(d.error_code_2, data(3, 1))
        local code = data(2, 1):uint()
        local reason = string.format("%02X %02X%s", code, data(3, 1):uint(), ERROR_CODE_1[code] and ", " .. ERROR_CODE_1[code] or "")
        branch:add_proto_expert_info(x.negative, text .. " refused: " .. reason)
        return text .. " refused " .. reason
    elseif fn == 0x5E or fn == 0x5F or fn == 0x51 then
        if short(tree, data, 4) then
            return text
        end
        tree:add(d.slot, data(1, 1))
        tree:add(d.index, data(2, 1))
        tree:add(d.length, data(3, 1))
        text = string.format("%s slot %d index %d length %d", text, data(1, 1):uint(), data(2, 1):uint(), data(3, 1):uint())
        if data:len() > 4 then
            tree:add(d.record, data(4))
            text = text .. ": " .. hex(data(4))
        end
        return text
    elseif fn == 0x5C then
        if short(tree, data, 4) then
            return text
        end
        tree:add(d.slot, data(1, 1))
        tree:add(d.alarm_type, data(2, 1))
        tree:add(d.alarm_sequence, data(3, 1))
        tree:add(d.alarm_add_ack, data(3, 1))
        tree:add(d.alarm_specifier, data(3, 1))
        return string.format("%s slot %d sequence %d", text, data(1, 1):uint(), data(3, 1):bitfield(0, 5))
    elseif fn == 0x56 then
        if short(tree, data, 4) then
            return text
        end
        tree:add(d.server_sap, data(1, 1))
        tree:add(d.send_timeout, data(2, 2))
        return text .. " Server_SAP " .. data(1, 1):uint()
    elseif fn == 0x57 then
        return text .. initiate(tree, data, is_request)
    elseif fn == 0x58 then
        if short(tree, data, 3) then
            return text
        end
        tree:add(d.abort_subnet, data(1, 1))
        tree:add(d.abort_instance, data(2, 1))
        local instance, reason = data(2, 1):bitfield(2, 2), data(2, 1):bitfield(4, 4)
        local branch = tree:add(d.abort_reason, data(2, 1))
        -- The names are those of the MSAC2 machine; other instances count on their own.
        local name = instance == 1 and ABORT_REASON[reason]
        if not name then
            branch:set_text("Reason: " .. reason)
        end
        return string.format("%s by %s: %s", text, ABORT_INSTANCE[instance] or instance, name or reason)
    end
    if data:len() > 1 then
        tree:add(d.other, data(1))
        text = text .. " " .. hex(data(1))
    end
    return text
end

-- Adds the data unit of a service to the tree and returns its text for the info column.
local function decode_service(tree, service, data, is_request)
    if service == "Data_Exchange" then
        if data then
            tree:add(is_request and d.outputs or d.inputs, data)
            return (is_request and "out " or "in ") .. hex(data)
        end
        return ""
    elseif service == "Slave_Diag" and not is_request then
        return slave_diag(tree, data)
    elseif service == "Set_Prm" and is_request then
        return set_prm(tree, data)
    elseif (service == "Chk_Cfg" and is_request) or (service == "Get_Cfg" and not is_request) then
        return configuration(tree, data)
    elseif service == "Global_Control" then
        return global_control(tree, data)
    elseif service == "Set_Slave_Add" and is_request then
        return set_slave_add(tree, data)
    elseif (service == "Rd_Inp" or service == "Rd_Outp") and not is_request and data then
        tree:add(service == "Rd_Inp" and d.inputs or d.outputs, data)
        return hex(data)
    elseif service == "MSAC1" or service == "MSAC2" or service == "Master_Master" then
        return acyclic(tree, data, is_request)
    elseif data then
        tree:add(d.other, data)
        return hex(data)
    end
    return ""
end

-- ---------------------------------------------------------------------------------------------------------------------------------------
-- Telegrams

local function relate(tree, pinfo)
    local here = relations[pinfo.number]
    if not here then
        return
    end
    if here.retry_of then
        tree:add(f.retry_of, here.retry_of):set_generated()
        tree:add_proto_expert_info(e.retry)
    end
    if here.response then
        tree:add(f.response_in, here.response):set_generated()
    end
    if here.request then
        tree:add(f.request_in, here.request):set_generated()
        tree:add(f.response_time, here.time):set_generated()
    end
    if here.t_sdr then
        tree:add(f.t_sdr, here.t_sdr):set_generated()
    end
    if here.rotation then
        tree:add(f.rotation, here.rotation):set_generated()
    end
end

-- Octets that are no telegram, shown with whatever is known about the reason.
local function invalid(tvb, pinfo, tree, reason)
    local comment = frame_comment()
    local text = comment and tostring(comment.value) or reason
    local lost = tvb:reported_len() - tvb:len()
    local branch = tree:add(fdl, tvb(), "PROFIBUS FDL, no valid telegram: " .. text)
    if tvb:len() > 0 then
        branch:add(f.invalid, tvb())
    end
    if lost > 0 then
        branch:add(f.lost, lost):set_generated()
    end
    branch:add_proto_expert_info(e.format, text)
    pinfo.cols.info = "no valid telegram: " .. text .. (lost > 0 and ", " .. lost .. " characters lost" or "")
    return branch
end

local function addresses(pinfo, da, sa)
    pinfo.cols.src = tostring(sa)
    pinfo.cols.dst = da == 127 and "all" or tostring(da)
end

local function token(tvb, pinfo, tree)
    local da, sa = tvb(1, 1):uint(), tvb(2, 1):uint()
    if not pinfo.visited then
        learn_token(pinfo, sa)
    end
    addresses(pinfo, da, sa)
    local branch = tree:add(fdl, tvb(), string.format("PROFIBUS FDL, token %d → %d", sa, da))
    branch:add(f.sd, tvb(0, 1))
    branch:add(f.da, tvb(1, 1))
    branch:add(f.sa, tvb(2, 1))
    branch:add(f.service, "Token"):set_generated()
    relate(branch, pinfo)
    pinfo.cols.info = string.format("%d → %d  token", sa, da)
end

local function short_ack(tvb, pinfo, tree)
    if not pinfo.visited then
        learn_response(pinfo)
    end
    local here = relations[pinfo.number]
    local branch = tree:add(fdl, tvb(), "PROFIBUS FDL, short acknowledgement")
    branch:add(f.sd, tvb(0, 1))
    branch:add(f.response, true):set_generated()
    branch:add(f.service, "Short_Ack"):set_generated()
    pinfo.cols.info = "short acknowledgement"
    if here and here.peers then
        addresses(pinfo, here.peers.da, here.peers.sa)
        pinfo.cols.info = string.format("%d → %d  short acknowledgement  %s", here.peers.sa, here.peers.da, here.service or "")
    end
    relate(branch, pinfo)
end

-- FC in words, and its parts in the tree.
local function function_code(tree, range, is_request)
    local branch = tree:add(f.fc, range)
    branch:add(f.fc_request, range)
    local fn = range:bitfield(0, 1) * 0x80 + range:bitfield(4, 4)
    local text
    if is_request then
        branch:add(f.fc_fcb, range)
        branch:add(f.fc_fcv, range)
        branch:add(f.fc_function, range)
        text = REQUEST_NAMES[fn] or string.format("request %02X", fn)
        local fcb, fcv = range:bitfield(2, 1), range:bitfield(3, 1)
        if fcv == 1 then
            text = text .. " FCB=" .. fcb
        elseif fcb == 1 then
            text = text .. " first"
        end
    else
        branch:add(f.fc_station, range)
        branch:add(f.fc_response, range)
        text = (RESPONSE_SHORT[fn] or string.format("response %02X", fn)) .. " " .. STATION_NAMES[range:bitfield(2, 2)]
    end
    branch:append_text(" (" .. text .. ")")
    return text, fn
end

-- DA, SA, FC, data, FCS and ED from `at` on, with `length` octets of data.
local function body(tvb, pinfo, root, at, length)
    local fcs_at = at + 3 + length
    local sum = 0
    for octet = at, fcs_at - 1 do
        sum = (sum + tvb(octet, 1):uint()) % 256
    end
    local fcs_good, ed_good = tvb(fcs_at, 1):uint() == sum, tvb(fcs_at + 1, 1):uint() == 0x16
    local valid = fcs_good and ed_good
    local da, sa = tvb(at, 1):bitfield(1, 7), tvb(at + 1, 1):bitfield(1, 7)
    local is_request = tvb(at + 2, 1):bitfield(1, 1) == 1
    addresses(pinfo, da, sa)
    local tree = root:add(fdl, tvb(), string.format("PROFIBUS FDL, %d → %s", sa, da == 127 and "all" or da))

    tree:add(f.sd, tvb(0, 1))
    if at == 4 then
        tree:add(f.le, tvb(1, 1))
        tree:add(f.ler, tvb(2, 1))
        tree:add(f.sd_again, tvb(3, 1))
    end
    local da_item, sa_item = tree:add(f.da, tvb(at, 1)), tree:add(f.sa, tvb(at + 1, 1))
    da_item:add(f.da_ext, tvb(at, 1))
    sa_item:add(f.sa_ext, tvb(at + 1, 1))
    local text, fn = function_code(tree, tvb(at + 2, 1), is_request)

    local data_at, left = at + 3, length
    local dsap, ssap
    if tvb(at, 1):bitfield(0, 1) == 1 and left > 0 then
        dsap = tvb(data_at, 1):uint()
        tree:add(f.dsap, tvb(data_at, 1)):append_text(sap_name(dsap, is_request))
        data_at, left = data_at + 1, left - 1
    end
    if tvb(at + 1, 1):bitfield(0, 1) == 1 and left > 0 then
        ssap = tvb(data_at, 1):uint()
        tree:add(f.ssap, tvb(data_at, 1)):append_text(sap_name(ssap, not is_request))
        data_at, left = data_at + 1, left - 1
    end
    local data = left > 0 and tvb(data_at, left) or nil
    if data then
        tree:add(f.data, data)
    end
    local fcs = tree:add(f.fcs, tvb(fcs_at, 1))
    fcs:add(f.fcs_status, tvb(fcs_at, 1), fcs_good and 1 or 0):set_generated()
    if not fcs_good then
        fcs:append_text(string.format(" (expected 0x%02x)", sum))
        fcs:add_proto_expert_info(e.fcs, string.format("frame check sequence must be 0x%02x, got 0x%02x", sum, tvb(fcs_at, 1):uint()))
    end
    local ed = tree:add(f.ed, tvb(fcs_at + 1, 1))
    if not ed_good then
        ed:add_proto_expert_info(e.format, "end delimiter must be 0x16")
    end
    if not valid then
        -- What a disturbed telegram asks or answers proves nothing.
        pinfo.cols.info = string.format("%d → %s  %s  [%s]", sa, da == 127 and "all" or da, text, fcs_good and "bad end delimiter" or "bad FCS")
        return
    end

    local service
    if is_request then
        service = service_of(true, fn, dsap, ssap, left)
    else
        service = service_of(false, fn, ssap, dsap, left)
    end
    if not pinfo.visited then
        if is_request then
            learn_request(pinfo, tostring(tvb():bytes()), da, sa, service, not UNACKNOWLEDGED[fn] and da ~= 127)
        else
            learn_response(pinfo, da, sa)
        end
    end
    local here = relations[pinfo.number]
    if not service then
        service = here and here.service or (fn == 0 and "FDL_Status" or "FDL")
    end
    tree:add(is_request and f.request or f.response, true):set_generated()
    tree:add(f.service, service):set_generated()
    relate(tree, pinfo)
    if not is_request then
        if not here or not here.request then
            tree:add_proto_expert_info(e.stray)
        elseif fn >= 1 and fn <= 3 then
            tree:add_proto_expert_info(e.refused, service .. " refused: " .. RESPONSE_NAMES[fn])
        end
    end

    local info = string.format("%d → %s  %s  %s", sa, da == 127 and "all" or da, text, service)
    local is_dp = service ~= "FDL" and service ~= "FDL_Status" and service ~= "Ident" and service ~= "LSAP_Status" and service ~= "Clock"
    if is_dp then
        pinfo.cols.protocol = "PROFIBUS DP"
        local refused = not is_request and not data and NO_RESPONSE_DATA[fn]
        if not refused then
            local branch = root:add(dp, data or tvb(data_at, 0), "PROFIBUS DP, " .. service .. (is_request and " request" or " response"))
            local content = decode_service(branch, service, data, is_request)
            info = content ~= "" and info .. "  " .. content or info
        end
    elseif data then
        info = info .. "  " .. hex(data)
    end
    pinfo.cols.info = info
end

function fdl.dissector(tvb, pinfo, root)
    pinfo.cols.protocol = "PROFIBUS FDL"
    local length = tvb:len()
    if length == 0 then
        invalid(tvb, pinfo, root, "a character could not be received")
        return 0
    end
    local sd = tvb(0, 1):uint()
    if tvb:reported_len() > length then
        invalid(tvb, pinfo, root, "a character could not be received")
    elseif sd == 0xE5 and length == 1 then
        short_ack(tvb, pinfo, root)
    elseif sd == 0xDC and length == 3 and tvb(1, 1):uint() < 127 and tvb(2, 1):uint() < 127 then
        token(tvb, pinfo, root)
    elseif sd == 0x10 and length == 6 then
        body(tvb, pinfo, root, 1, 0)
    elseif sd == 0xA2 and length == 14 then
        body(tvb, pinfo, root, 1, 8)
    elseif sd == 0x68 and length >= 10 and tvb(1, 1):uint() == length - 6 and tvb(2, 1):uint() == length - 6 and tvb(3, 1):uint() == 0x68 then
        body(tvb, pinfo, root, 4, length - 9)
    elseif sd == 0x68 and length >= 3 and tvb(1, 1):uint() ~= tvb(2, 1):uint() then
        invalid(tvb, pinfo, root, string.format("length LE is %d, but repeated as %d", tvb(1, 1):uint(), tvb(2, 1):uint()))
    elseif SD_NAMES[sd] then
        invalid(tvb, pinfo, root, "length does not fit the start delimiter")
    else
        invalid(tvb, pinfo, root, string.format("octet 0x%02x is no start delimiter", sd))
    end
    return length
end

-- 0 is the encapsulation of every link type that Wireshark does not know. For files with a user link type (DLT 147 to 162) enter
-- "profibus" under Preferences > Protocols > DLT_USER.
DissectorTable.get("wtap_encap"):add(0, fdl)
