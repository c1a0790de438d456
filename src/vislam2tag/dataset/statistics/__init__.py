"""What a data set holds, in numbers: walks counted one after the other, the record, the paper's Table III."""
