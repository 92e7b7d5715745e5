"""The method of ARL-TR-6381 (Delmerico, Corso, Baran, David 2013), line by line, as the baseline."""
