"""An SDO client that is not ours: the package canopen, on a SocketCAN interface.

    canopen_client.py INTERFACE NODE

Reads C0061, writes C0012 := 20 s, reads it back, asks for a code that does not exist; writes a line of JSON for each.
"""

import json
import sys

import canopen


def main():
    interface, node_id = sys.argv[1], int(sys.argv[2])
    network = canopen.Network()
    network.connect(interface="socketcan", channel=interface)
    try:
        node = network.add_node(node_id, canopen.ObjectDictionary())
        node.sdo.RESPONSE_TIMEOUT = 2.0
        index = lambda code: 24575 - code
        tell = lambda **what: print(json.dumps(what), flush=True)
        tell(code=61, octets=node.sdo.upload(index(61), 0).hex())
        node.sdo.download(index(12), 0, (200_000).to_bytes(4, "little"))
        tell(code=12, octets=node.sdo.upload(index(12), 0).hex())
        try:
            node.sdo.upload(index(9998), 0)
            tell(code=9998, octets="")
        except canopen.SdoAbortedError as refused:
            tell(code=9998, abort=f"{refused.code:08X}")
    finally:
        network.disconnect()


main()
