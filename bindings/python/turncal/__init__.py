from turncal._frames import run
from turncal._turncal import Calibration, Error, Report, Run, command, read, init, allan
def _command():
    import sys
    return command(["turncal", *sys.argv[1:]])
