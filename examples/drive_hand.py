"""Drives a hand from Python: the way in for every glove that only its maker's SDK can read.

    pip install grpcio grpcio-tools
    python -m grpc_tools.protoc -I proto/proto --python_out=. --grpc_python_out=. proto/proto/tsukamu/v1/*.proto
    python examples/drive_hand.py [ADDRESS] [left|right]     # with PYTHONPATH=. where the two lines above put the code

Put what your SDK says into `read_glove` and `read_wrist`; the rest can stay.
"""
import math, sys, time
import grpc
from tsukamu.v1 import common_pb2 as c, hands_pb2 as h, service_pb2_grpc as rpc

ADDRESS = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7447"
SIDE = sys.argv[2] if len(sys.argv) > 2 else "right"
RATE_HZ = 90.0


def read_glove(t):
    """21 joint angles in radians at time t. Here a hand that opens and closes once in four seconds."""
    bend = 0.5 - 0.5 * math.cos(math.pi * t / 2)
    thumb = [0.6, 0.3, 0.5 * bend, 0.6 * bend]           # opposition, abduction, MCP and IP flexion
    finger = [1.1 * bend, 1.2 * bend, 0.7 * bend, 0.0]   # MCP, PIP, DIP flexion, abduction
    return thumb + 4 * finger + [0.0]                    # index, middle, ring, little; then the palm arch


def read_wrist(t):
    """Position in metres (y up) and quaternion x, y, z, w of the wrist: -z to the fingers, +y out of the hand's back."""
    return c.Pose(position=c.Vec3(x=0.0, y=0.09, z=-0.24), rotation=c.Quat(w=1.0))


def samples():
    side = c.SIDE_LEFT if SIDE == "left" else c.SIDE_RIGHT
    yield h.DriveRequest(open=h.DriveOpen(name=f"python:{SIDE}", side=side))
    start = time.monotonic()
    n = 0
    while True:
        t = time.monotonic() - start
        yield h.DriveRequest(sample=h.HandSample(
            source_ns=time.monotonic_ns(), wrist=read_wrist(t), angles=read_glove(t),
            valid=True))                                 # False while your SDK has lost the hand
        n = max(n + 1, math.ceil(t * RATE_HZ))           # a late sample is not made up for
        time.sleep(max(0.0, start + n / RATE_HZ - time.monotonic()))


shown = 0.0
try:
    for answer in rpc.HandsStub(grpc.insecure_channel(ADDRESS)).Drive(samples()):
        if answer.WhichOneof("kind") == "opened":
            print(f"hand {answer.opened.hand} is in the world; tsukamu watch shows it; Ctrl-C ends it")
        elif time.monotonic() - shown > 0.5:
            shown, state = time.monotonic(), answer.state
            touching = sorted({contact.part for contact in state.contacts})
            print(f"tick {answer.stamp.tick}: holds {state.holds - 1 if state.holds else 'nothing'}, touches with {touching}")
except grpc.RpcError as error:
    sys.exit(f"{ADDRESS}: {error.details()}")
except KeyboardInterrupt:
    pass
