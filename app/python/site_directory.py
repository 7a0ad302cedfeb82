"""Prints where below a prefix this Python looks for packages, relative to the prefix.

usage: site_directory.py PREFIX"""

import os
import sys
import sysconfig

prefix = os.path.normpath(sys.argv[1])
if prefix == "/usr" and "deb_system" in sysconfig.get_scheme_names():  # for Debian's own packages
    path = sysconfig.get_path("platlib", "deb_system")
else:
    path = sysconfig.get_path("platlib")  # where it looks by itself
    if not path.startswith(prefix + os.sep) or prefix == "/usr":
        path = sysconfig.get_path("platlib", "posix_prefix", {"base": prefix, "platbase": prefix})
print(os.path.relpath(path, prefix))
