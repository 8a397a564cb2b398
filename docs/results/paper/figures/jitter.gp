set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'jitter.png'
set datafile separator comma
set title 'Success against the link''s jitter, position 0.3 m, 8 m/s'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'link jitter [ms]'
set xrange [17:83]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'jitter.csv' skip 1 every ::0::2 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'with prediction', \
     'jitter.csv' skip 1 every ::0::2 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'jitter.csv' skip 1 every ::3::5 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'without prediction', \
     'jitter.csv' skip 1 every ::3::5 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle
