"""Permissions that apply to a process, also where tests run as root."""

import ctypes
import os

#: Of Linux: prctl(PR_CAPBSET_DROP), the version of capset(), and the rights to pass over permissions and owners.
_DROP, _VERSION, _OVERRIDE = 24, 0x20080522, (1, 2, 3)


def give_up() -> None:
    """Give up root's rights to pass over permissions, in this process and in what it starts."""
    if os.geteuid() == 0:
        library, held = ctypes.CDLL(None), (ctypes.c_uint32 * 6)()
        for right in _OVERRIDE:
            library.prctl(_DROP, right, 0, 0, 0)
        own = (ctypes.c_uint32 * 2)(_VERSION, 0)
        library.capget(own, held)
        for kind in range(3):  # in force, permitted, inherited
            held[kind] &= ~sum(1 << right for right in _OVERRIDE)
        library.capset(own, held)
