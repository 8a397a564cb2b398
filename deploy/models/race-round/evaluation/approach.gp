set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'approach.png'
set datafile separator comma
set title 'Error of the centre along approaches'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'distance [m]'
set ylabel 'error of the centre [m]'
set yrange [0:*]
plot 'approach.csv' skip 1 every ::0::13 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'single frame, median', \
     'approach.csv' skip 1 every ::14::27 using 2:3 with lines lw 2 lc rgb '#0072b2' dt 2 title 'single frame, 90th percentile', \
     'approach.csv' skip 1 every ::28::41 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'gate memory, median', \
     'approach.csv' skip 1 every ::42::55 using 2:3 with lines lw 2 lc rgb '#d55e00' dt 2 title 'gate memory, 90th percentile'
