"""The commands, one file each: whatever `command` is in a module here is a command of the program."""
