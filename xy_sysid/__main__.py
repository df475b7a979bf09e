"""python -m xy_sysid"""

from xy_sysid.cli import main

if __name__ == "__main__":
    main()
