"""Reads courses, vehicles and camera calibrations of other projects, and writes them as Gatefield's text files.

`gatefield-import` (`python3 -m gatefield import`) is made of this. A reader takes what its file says and nothing else;
what is missing comes from an option or is refused by that option's name, and what had to be read one way among several
is said in a note.
"""
