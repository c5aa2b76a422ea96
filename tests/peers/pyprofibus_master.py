"""A DP master made of pyprofibus 1.13: brings the drive into data exchange and reads a code through its parameter channel.

Events go to standard output, one JSON object a line:

    {"event": "data exchange"}                      the slave was parametrised, configured and exchanges data
    {"event": "value", "data": "001b52f4", ...}     an answer of the parameter channel
    {"event": "left"}                               data exchange was lost
    {"event": "done", "exchanges": 123}             as many values were read as were asked for

Exit code 0 when done, 1 when the time was over before.

    python pyprofibus_master.py --port /dev/pts/5 --baud 19200 --address 3 --gsd LENZ00DA.GSD --values 4
"""

import argparse
import io
import json
import sys
import time

CONFIGURATION = """
[PROFIBUS]
debug = {debug}
[PHY]
type = serial
dev = {port}
baud = {baud}
[DP]
master_class = 1
master_addr = {master}
[SLAVE_0]
addr = {address}
gsd = {gsd}
sync_mode = 0
freeze_mode = 0
group_mask = 1
watchdog_ms = {watchdog_ms}
input_size = 16
output_size = 16
module_0 = PAR(Cons.) + PZD(4W Cons.)
"""

READ = 0x01
LENGTH_4 = 0x30
HANDSHAKE = 0x40
ERROR = 0x80


def tell(**event):
    # pyprofibus prints too; one write a line keeps the lines whole.
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()


class ParameterReader:
    """Reads one code again and again: a job begins when the handshake bit is inverted, and ends when the answer shows it.

    Octets: service, subindex, index high, index low, four of data. The first request is all zero and takes the handshake
    of whoever was there before back to 0.
    """

    def __init__(self, index):
        self.index = index
        self.restart()

    def restart(self):
        """Begins anew: a drive that was away may have forgotten the job and its handshake."""
        self.request = bytes(8)

    def next(self, answer):
        """Takes the present answer; returns the finished one, or None."""
        if (answer[0] ^ self.request[0]) & HANDSHAKE:
            return None
        finished = answer if self.request[0] & READ else None
        handshake = ~self.request[0] & HANDSHAKE
        service = READ | LENGTH_4 | handshake
        self.request = bytes([service, 0]) + self.index.to_bytes(2, "big") + bytes(4)
        return finished


def parse_arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", required=True)
    parser.add_argument("--baud", type=int, required=True)
    parser.add_argument("--address", type=int, default=3)
    parser.add_argument("--master", type=int, default=2)
    parser.add_argument("--gsd", required=True)
    parser.add_argument("--index", type=lambda text: int(text, 0), default=0x5B4B)
    parser.add_argument("--watchdog-ms", type=int, default=1000)
    parser.add_argument("--values", type=int, default=0, help="so many, then stop; 0 = for ever")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--debug", type=int, default=0)
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    import pyprofibus
    from pyprofibus.conf import PbConf

    text = CONFIGURATION.format(**vars(arguments))
    configuration = PbConf(io.StringIO(text), "configuration")
    master = configuration.makeDPM()
    slave = configuration.slaveConfs[0].makeDpSlaveDesc()
    master.addSlave(slave)
    master.initialize()

    reader = ParameterReader(arguments.index)
    exchanging = False
    exchanges = values = 0
    end = time.monotonic() + arguments.seconds
    try:
        while time.monotonic() < end:
            if not exchanging:
                reader.restart()
            slave.setMasterOutData(reader.request + bytes(8))
            master.run()
            if slave.isConnected() != exchanging:
                exchanging = not exchanging
                tell(event="data exchange" if exchanging else "left")
            inputs = slave.getMasterInData()
            if inputs is None:
                # Nothing came; the processor belongs to others, too.
                time.sleep(0.000_2)
                continue
            exchanges += 1
            answer = reader.next(bytes(inputs[:8]))
            if answer is None:
                continue
            values += 1
            tell(
                event="value",
                ok=not answer[0] & ERROR,
                index=int.from_bytes(answer[2:4], "big"),
                data=answer[4:].hex(),
            )
            if values == arguments.values:
                tell(event="done", exchanges=exchanges)
                return 0
    except pyprofibus.ProfibusError as error:
        tell(event="error", text=str(error))
        return 1
    finally:
        master.destroy()
    tell(event="time is over", exchanges=exchanges, values=values)
    return 1


if __name__ == "__main__":
    sys.exit(main())
