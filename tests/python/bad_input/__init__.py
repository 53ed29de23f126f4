"""All tested kinds of bad input: the cases, and the page that lists them.

`case.py` says what a case is and runs one; the modules beside it hold the cases of one interface
each; `page.py` writes the page of bad input on the site from them.
"""
